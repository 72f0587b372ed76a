// Values at the cursor as text: those of the last recorded row before it, never interpolated.
// No function here changes the page.

const NEEDED = ["time", ...["x", "y", "z"].map((a) => `position.${a}`), ...[0, 1, 2, 3].map((e) => `quaternion.e${e}`)];
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
  const after = size >= 100 ? 0 : size >= 10 ? Math.min(1, digits) : size >= 1 ? Math.min(2, digits) : digits;
  return decimals(x, after);
}

/** Format a quantity with its unit: kilo for large forces, degrees for radians; "no number" for NaN, infinity and null. */
function quantity(x, unit, digits = 3) {
  if (!Number.isFinite(x)) return "no number";
  if (unit === "rad") return `${figure(x * DEGREES, 1)}°`;
  if (unit === "rad/s") return `${figure(x * DEGREES, 1)}°/s`;
  if (Math.abs(x) >= 10000 && /^N/.test(unit)) return `${figure(x / 1000, 1)} k${unit.replace(".", "\u00b7")}`;
  return unit ? `${figure(x, digits)} ${unit.replace(".", "\u00b7")}` : figure(x, 2);
}

/** Format a number without its unit: degrees for radians. */
function reading(x, unit) {
  return unit === "rad" ? figure(x * DEGREES, 1) : figure(x, unit ? 3 : 2);
}

/** Format a time [s]: 12.34 s below 100 s, else 3:07.5. */
function clock(t, digits = 2) {
  if (!(t >= 100) || t === Infinity) return `${decimals(t, digits)} s`;
  const tenths = Math.round(t * 10);
  return `${Math.floor(tenths / 600)}:${((tenths % 600) / 10).toFixed(1).padStart(4, "0")}`;
}

/** Return distinct names of runs. */
function runNames(runs) {
  const names = runs.map((run) => run.header.name || run.header.title || "run");
  const all = new Set(names);
  if (all.size === names.length) return names;
  return names.map((name, i) => (names.indexOf(name) === names.lastIndexOf(name) ? name : `${name} (${i + 1})`));
}

/** Return true if a run has the signals that the scene needs. */
function drawable(run) {
  return run.rows > 0 && NEEDED.every((name) => run.has(name));
}

/** Return true if a run has finite times; without them it cannot be shown. */
function timed(run) {
  return run.has("time") && Number.isFinite(run.start) && Number.isFinite(run.end);
}

/** Return the name of a region; of the goal at one of its places in turn, with which one that is: "next goal (2 of 3)". */
function regionName({ name, places }, place, which = "") {
  return places ? `${which} ${name} (${place + 1} of ${places.length})`.trim() : name;
}

/** Describe a region at a time [s]: criterion, side, hardness and motion ("obstacle · keep out · hard · moves"). */
function regionWords(run, index, t) {
  const region = run.header.regions[index];
  const keep = region.keep === "in" ? "keep inside" : "keep out";
  const inTurn = region.places ? ` · now ${run.goalPlace(t) + 1} of ${region.places.length}` : "";
  const criterion = region.criterion ? `${region.criterion} · ${keep} · ${region.hard ? "hard" : "soft"}` : `goal · get inside${inTurn}`;
  return run.moves(index, t) ? `${criterion} · moves` : criterion;
}

/** Format a clearance: "1.20 m clear", "violated by 0.03 m"; of the goal "2.00 m to go", "inside by 0.10 m". */
function clearanceWords(clearance, region) {
  if (!Number.isFinite(clearance)) return "no number";
  const size = quantity(Math.abs(clearance), region.unit);
  if (!region.criterion) return clearance < 0 ? `${size} to go` : `inside by ${size}`;
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
function slow(run, t) {
  return Math.hypot(...["u", "v", "w"].map((axis) => run.held(`velocity.${axis}`, t))) < 0.02; // m/s
}

/** Return the active region at a time [s] with an explanation: {index, name, region, sentence}. */
function activeWords(run, t) {
  const index = run.active(t);
  const region = run.header.regions[index];
  const clearance = run.held(`${region.name}.clearance`, t);
  const asked = clearanceWords(clearance, region);
  if (run.header.imported) {
    return { index: -1, name: "imported", region: null, sentence: `Imported from ${run.header.imported}: no arbiter decided here.` };
  }
  let sentence = `No region asks: the goal region alone steers, ${asked}.`;
  if (region.criterion) {
    const weight = run.held(`weight.${region.criterion}`, t);
    const share = Number.isFinite(weight) ? ` with weight ${figure(weight, 2)}` : "";
    sentence = `The criterion ${region.criterion} leads${share}; ${region.name} is most critical: ${asked}.`;
  } else if (clearance >= 0) {
    sentence = `${slow(run, t) ? "At rest" : "On the move"} in the goal region, ${asked}.`;
  }
  if (!run.rows || Number.isNaN(run.held("active", t))) {
    return { index: -1, name: "not recorded", region: null, sentence: "The record does not say which region is active here." };
  }
  return { index, name: region.name, region, sentence };
}

/** Return the rules of the arbiter with the firing strength of each at a time [s]. */
function firedRules(run, t) {
  return run.header.rules.map((rule) => ({ ...rule, strength: run.held(`rule.${rule.label}`, t) }));
}

/** Return the regions with their clearances at a time [s]: the goal first, then by rising clearance. */
function distancesAt(run, t) {
  const rows = run.header.regions.map((region, index) => ({
    index,
    region,
    clearance: run.held(`${region.name}.clearance`, t),
  }));
  const press = (row) => (row.index === 0 ? -Infinity : Number.isNaN(row.clearance) ? Infinity : row.clearance);
  return rows.sort((a, b) => press(a) - press(b) || a.index - b.index);
}

/** Return the norm of three signals, one number for each row; null if one is missing. */
function sizes(run, names) {
  const [x, y, z] = names.map((name) => run.column(name));
  if (!x || !y || !z) return null;
  return Float64Array.from(x, (_, i) => Math.sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]));
}

/** Return the values of the vehicle at a time [s]: [name, text] in the order of the panel; an empty text is left out. */
function numbersAt(run, t) {
  const of = (name) => run.held(name, t);
  const size = (names) => Math.hypot(...names.map(of));
  const limited = ["wrench_saturated", "allocation_saturated"].some((name) => run.held(name, t) > 0);
  return [
    ["North, east", `${quantity(of("position.x"), "m")}, ${quantity(of("position.y"), "m")}`],
    ["Depth", quantity(of("position.z"), "m")],
    ["Speed over ground", quantity(size(["velocity.u", "velocity.v", "velocity.w"]), "m/s")],
    ["Current", run.current(t) ? currentWords(run.current(t)) : ""],
    ["Heading", quantity(of("attitude.yaw"), "rad")],
    ["Roll, pitch", `${quantity(of("attitude.roll"), "rad")}, ${quantity(of("attitude.pitch"), "rad")}`],
    ["Force asked", quantity(size(["command.X", "command.Y", "command.Z"]), "N")],
    ["Force that acts", quantity(size(["actuation.X", "actuation.Y", "actuation.Z"]), "N")],
    ["Limits", limited ? "cut what is asked" : "not reached"],
  ];
}

/** Rate the outcome of a run: "good"; "bad" if a hard region is violated or the goal never settled; else "fair". */
function outcome(run) {
  const { summary, regions, imported } = run.header;
  if (!summary) return "fair";
  const broken = regions.filter((region) => summary.min_clearance?.[region.name] < 0);
  if (broken.some((region) => region.hard) || (summary.settle_time === null && !imported)) return "bad";
  return broken.length ? "fair" : "good";
}

/** Return warnings about an incomplete run or record as sentences; none for a complete one. */
function troubles(run) {
  const { status } = run.header;
  const said = [];
  const { imported } = run.header;
  if (status && status !== "completed" && !imported) said.push(UNFINISHED[status] ?? `This run did not complete: it ${status}.`);
  const missing = NEEDED.filter((name) => !run.has(name));
  if (missing.length) said.push(`The record has no ${missing.join(", ")}: the scene cannot be drawn.`);
  const kinds = ["clearance", "membership.", "weight.", "command.", "actuation.", "estimate.", "active", "rule."];
  const absent = kinds.filter((kind) => !run.header.signals.some(({ name }) => name.includes(kind)));
  if (absent.length && !imported) said.push(`The record has no signals named ${absent.join(", ")}: what rests on them is left out.`);
  if (!run.rows && status) said.push("The record has no row."); // a live run has none at first, and no status
  if (run.rows === 1 && status) said.push("The record has one row only: there is nothing to play.");
  const { gaps = {} } = run.header; // of the whole record, which may have more rows than the page
  const holes = run.header.signals.map(({ name }) => name).filter((name) => gaps[name] || run.column(name).includes(NaN));
  if (holes.length) {
    const listed = holes.slice(0, 4).map((name) => (gaps[name] ? `${name} (${gaps[name]} steps)` : name));
    const more = holes.length > 4 ? ` and ${holes.length - 4} more` : "";
    said.push(`No number at some times in ${listed.join(", ")}${more}: gaps in the curves are gaps in the record.`);
  }
  return said;
}

/** Return the intervals of time in which a signal is below 0: [[from, to], ...]. */
function below(run, name) {
  const column = run.column(name);
  const stretches = [];
  if (!column) return stretches;
  let from = -1;
  for (let i = 0; i <= run.rows; i++) {
    const under = i < run.rows && column[i] < 0;
    if (under && from < 0) from = i;
    if (!under && from >= 0) {
      stretches.push([run.time[from], run.time[Math.min(i, run.rows - 1)]]);
      from = -1;
    }
  }
  return stretches;
}
