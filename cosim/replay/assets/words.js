// Values at the cursor as text: those of the last recorded row before it, never interpolated.
// No function here changes the page.

const NEEDED = ["time", ...[..."xyz"].map((a) => `position.${a}`), ...[0, 1, 2, 3].map((e) => `quaternion.e${e}`)];
const KINDS = ["clearance", "membership.", "weight.", "command.", "actuation.", "estimate.", "active", "rule."];
const DEGREES = 180 / Math.PI;
const UNFINISHED = {
  killed: "This run did not complete: it was killed. What follows ends with the last rows that were saved.",
  interrupted: "This run did not complete: it was interrupted.",
  reset: "This run did not complete: it was reset on the way.",
};

/** Format a number with some decimals and a true minus sign; "–" for NaN, infinity and null. */
function decimals(x, digits) {
  if (!Number.isFinite(x)) return "–";
  const text = Math.abs(x).toFixed(digits);
  return (x < 0 && Number(text) !== 0 ? "\u2212" : "") + text;
}

/** Format a number with three significant digits, and at most `digits` decimals. */
function figure(x, digits = 3) {
  const size = Math.abs(x);
  const limit = size >= 100 ? 0 : size >= 10 ? 1 : size >= 1 ? 2 : digits;
  return decimals(x, Math.min(limit, digits));
}

/** Return a unit as it is written: "N·m". */
const unitText = (unit) => unit.replace(".", "\u00b7");

/** Format a quantity with its unit: kilo for large forces, degrees for radians; "no number" for NaN, infinity, null. */
function quantity(x, unit, digits = 3) {
  if (!Number.isFinite(x)) return "no number";
  if (unit === "rad" || unit === "rad/s") return `${figure(x * DEGREES, 1)}${unit.replace("rad", "°")}`;
  if (Math.abs(x) >= 10000 && unit.startsWith("N")) return `${figure(x / 1000, 1)} k${unitText(unit)}`;
  return unit ? `${figure(x, digits)} ${unitText(unit)}` : figure(x, 2);
}

/** Format a number without its unit: degrees for radians. */
const reading = (x, unit) => (unit === "rad" ? figure(x * DEGREES, 1) : figure(x, unit ? 3 : 2));

/** Format a number with at most four decimals for an input field, which is empty without one. */
const shortNumber = (x) => (Number.isFinite(x) ? String(Number(x.toFixed(4))) : "");

/** Format a time [s]: 12.34 s below 100 s, else 3:07.5. */
function clock(t, digits = 2) {
  if (!(t >= 100) || t === Infinity) return `${decimals(t, digits)} s`;
  const tenths = Math.round(t * 10);
  return `${Math.floor(tenths / 600)}:${((tenths % 600) / 10).toFixed(1).padStart(4, "0")}`;
}

/** Return distinct names of runs. */
function runNames(runs) {
  const names = runs.map((run) => run.header.name || run.header.title || "run");
  return names.map((name, i) => (names.indexOf(name) === names.lastIndexOf(name) ? name : `${name} (${i + 1})`));
}

/** Return true if a run has the signals that the scene needs. */
const drawable = (run) => run.rows > 0 && NEEDED.every((name) => run.has(name));

/** Return true if a run has finite times; without them it cannot be shown. */
const timed = (run) => run.has("time") && Number.isFinite(run.start) && Number.isFinite(run.end);

/** Return the name of a region; of the goal at one of its places in turn, with that: "next goal (2 of 3)". */
const regionName = ({ name, places }, place, which = "") =>
  places ? `${which} ${name} (${place + 1} of ${places.length})`.trim() : name;

/** Describe a region at a time [s]: criterion, side, hardness and motion ("obstacle · keep out · hard · moves"). */
function regionWords(run, index, t) {
  const { criterion, keep, hard, places } = run.header.regions[index];
  const words = criterion
    ? [criterion, keep === "in" ? "keep inside" : "keep out", hard ? "hard" : "soft"]
    : ["goal", "get inside", places && `now ${run.goalPlace(t) + 1} of ${places.length}`];
  return [...words, run.moves(index, t) && "moves"].filter(Boolean).join(" · ");
}

/** Format a clearance: "1.20 m clear", "violated by 0.03 m"; of the goal "2.00 m to go", "inside by 0.10 m". */
function clearanceWords(clearance, { criterion, unit }) {
  if (!Number.isFinite(clearance)) return "no number";
  const size = quantity(Math.abs(clearance), unit);
  if (!criterion) return clearance < 0 ? `${size} to go` : `inside by ${size}`;
  return clearance < 0 ? `violated by ${size}` : `${size} clear`;
}

/** Format a current [m/s, NED]: speed, and where it flows, as a course from north over east. */
function currentWords([north, east, down]) {
  const level = Math.hypot(north, east);
  if (!Number.isFinite(level + down)) return "no number";
  const course = `${Math.round((Math.atan2(east, north) * DEGREES + 360) % 360) % 360}°`.padStart(4, "0");
  const upright = `${figure(Math.abs(down), 2)} m/s ${down > 0 ? "down" : "up"}`;
  if (level < 0.1 * Math.abs(down)) return upright;
  return `${figure(level, 2)} m/s towards ${course}${Math.abs(down) < 0.1 * level ? "" : `, ${upright}`}`;
}

/** Return true if the speed at a time is that of a vehicle at rest, as in cosim/replay/activity.py. */
const slow = (run, t) => Math.hypot(...run.vectorHeld("velocity", t, "uvw")) < 0.02; // m/s

/** Return the active region at a time [s] with an explanation: {index, name, region, sentence}. */
function activeWords(run, t) {
  const { regions, imported } = run.header;
  const none = (name, sentence) => ({ index: -1, name, region: null, sentence });
  if (imported) return none("imported", `Imported from ${imported}: no arbiter decided here.`);
  if (Number.isNaN(run.held("active", t))) {
    return none("not recorded", "The record does not say which region is active here.");
  }
  const index = run.active(t);
  const region = regions[index];
  const clearance = run.held(`${region.name}.clearance`, t);
  const distance = clearanceWords(clearance, region);
  let sentence = `No region asks: the goal region alone steers, ${distance}.`;
  if (region.criterion) {
    const weight = run.held(`weight.${region.criterion}`, t);
    const share = Number.isFinite(weight) ? ` with weight ${figure(weight, 2)}` : "";
    sentence = `The criterion ${region.criterion} leads${share}; ${region.name} is most critical: ${distance}.`;
  } else if (clearance >= 0) {
    sentence = `${slow(run, t) ? "At rest" : "On the move"} in the goal region, ${distance}.`;
  }
  return { index, name: region.name, region, sentence };
}

/** Return the regions with their clearances at a time [s]: the goal first, then by rising clearance. */
function distancesAt(run, t) {
  const rows = run.header.regions.map((region, index) => {
    const clearance = run.held(`${region.name}.clearance`, t);
    const order = index === 0 ? -Infinity : Number.isNaN(clearance) ? Infinity : clearance;
    return { index, region, clearance, order };
  });
  return rows.sort((a, b) => (a.order === b.order ? a.index - b.index : a.order - b.order));
}

/** Return the norm of the vectors of a signal, one number for each row; null if a component is missing. */
function sizes(run, name) {
  const [x, y, z] = run.columns(name, "XYZ");
  return x && y && z && x.map((_, i) => Math.sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]));
}

/** Return the values of the vehicle at a time [s]: [name, text]; an empty text is left out. */
function numbersAt(run, t) {
  const value = (name, unit) => quantity(run.held(name, t), unit);
  const size = (name, axes, unit) => quantity(Math.hypot(...run.vectorHeld(name, t, axes)), unit);
  const current = run.current(t);
  const limited = run.held("wrench_saturated", t) > 0 || run.held("allocation_saturated", t) > 0;
  return [
    ["North, east", `${value("position.x", "m")}, ${value("position.y", "m")}`],
    ["Depth", value("position.z", "m")],
    ["Speed over ground", size("velocity", "uvw", "m/s")],
    ["Current", current ? currentWords(current) : ""],
    ["Heading", value("attitude.yaw", "rad")],
    ["Roll, pitch", `${value("attitude.roll", "rad")}, ${value("attitude.pitch", "rad")}`],
    ["Commanded force", size("command", "XYZ", "N")],
    ["Force that acts", size("actuation", "XYZ", "N")],
    ["Limits", limited ? "clip the command" : "not reached"],
  ];
}

/** Rate the outcome of a run: "good"; "bad" if a hard region is violated or the goal never settled; else "fair". */
function outcome({ header: { summary, regions, imported } }) {
  if (!summary) return "fair";
  const broken = regions.filter((region) => summary.min_clearance?.[region.name] < 0);
  if (broken.some((region) => region.hard) || (summary.settle_time === null && !imported)) return "bad";
  return broken.length ? "fair" : "good";
}

/** Return warnings about an incomplete run or record as sentences; none for a complete one. */
function troubles(run) {
  const { status, imported, signals, gaps = {} } = run.header; // gaps of the whole record, which may have more rows
  const missing = NEEDED.filter((name) => !run.has(name)).join(", ");
  const absent = KINDS.filter((kind) => !signals.some(({ name }) => name.includes(kind))).join(", ");
  const holes = signals.map(({ name }) => name).filter((name) => gaps[name] || run.column(name).includes(NaN));
  const listed = holes.slice(0, 4).map((name) => (gaps[name] ? `${name} (${gaps[name]} steps)` : name)).join(", ");
  const more = holes.length > 4 ? ` and ${holes.length - 4} more` : "";
  return [
    status && status !== "completed" && !imported && (UNFINISHED[status] ?? `This run did not complete: it ${status}.`),
    missing && `The record has no ${missing}: the scene cannot be drawn.`,
    absent && !imported && `The record has no signals named ${absent}: what rests on them is left out.`,
    !run.rows && status && "The record has no row.", // a live run has none at first, and no status
    run.rows === 1 && status && "The record has one row only: there is nothing to play.",
    listed && `No number at some times in ${listed}${more}: gaps in the curves are gaps in the record.`,
  ].filter(Boolean);
}

/** Return the rows at which a signal changes, as intervals: [{from, until, value}], rows; `until` is the next one's. */
function stretches(column) {
  const rows = Array.from(column.keys()).filter((i) => i === 0 || column[i] !== column[i - 1]);
  return rows.map((from, k) => ({ from, until: rows[k + 1] ?? column.length - 1, value: column[from] }));
}

/** Return the intervals of time in which a signal is below 0: [[from, to], ...]. */
function below(run, name) {
  const under = stretches(run.column(name)?.map((x) => Number(x < 0)) ?? []);
  return under.filter(({ value }) => value).map(({ from, until }) => [run.time[from], run.time[until]]);
}
