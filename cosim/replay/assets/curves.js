// Curves of the charts: signals of the runs with names, colors and dashes.

const IN_TURN = ["blue", "vermillion", "green", "purple"];
const DASHES = [[], [7, 4], [2, 3], [10, 3, 2, 3], [14, 4], [4, 2, 1, 2, 1, 2]];
const NAMED = 6; // number of regions that the distance chart names

/** Return the dash pattern of a run on a page with several. */
const runDash = (index) => DASHES[index % DASHES.length];

/** Return the hue of the theme for a color of the header in the palette; other colors stay. */
const hueOf = (color) => Object.keys(PALETTE).find((hue) => PALETTE[hue] === color.toLowerCase()) ?? color;

/** Return the CSS color of a hue or of "#rrggbb", mixed with the share `shade` of ink. */
function hueColor(hue, shade = 0) {
  const base = COLORS[hue] ?? legible(hue);
  return shade ? mixedColor(base, COLORS.ink, shade) : base;
}

/** Return the criteria of some runs, each name once, in the order of priority. */
function criteriaOf(runs) {
  const all = runs.flatMap((run) => run.header.criteria);
  return all.filter(({ name }, i) => all.findIndex((one) => one.name === name) === i);
}

/** Return a signal of a chart; `more` overrides the defaults. */
function signal(name, label, hue, more = {}) {
  const values = (run) => run.column(name);
  return { name, label, hue, shade: 0, dash: [], faint: false, context: false, values, ...more };
}

/** Return signals with colors in turn; from the fifth on darker and dashed. */
function inTurn(names, labels) {
  const again = { dash: [6, 3], shade: 0.45 };
  return names.map((name, i) => signal(name, labels[i], IN_TURN[i % 4], i < 4 ? {} : again));
}

/** Return a function from run to clearances of a region; NaN while a temporary obstacle is absent. */
const clearanceOf = ({ name, is_dynamic: isDynamic }) => (run) => {
  const values = run.column(`${name}.clearance`);
  if (!values || !isDynamic) return values;
  const shifts = run.columns(`${name}.shift`);
  return values.map((value, row) => (shifts.some((shift) => shift[row] !== 0) ? value : NaN));
};

/** Return the clearance signals of regions with one unit: the nearest named, the others thin and gray. */
function clearances(runs, unit) {
  const byName = new Map();
  for (const run of runs) {
    for (const region of run.header.regions.filter((one) => one.unit === unit)) {
      const values = clearanceOf(region)(run);
      if (!values || (region.is_dynamic && !values.some(Number.isFinite))) continue; // no value so far: not added yet
      const before = byName.get(region.name)?.least ?? Infinity;
      byName.set(region.name, { region, least: values.reduce((a, b) => (b < a ? b : a), before) });
    }
  }
  const all = [...byName.values()];
  const near = all.filter(({ region }) => region.criterion).sort((a, b) => a.least - b.least).slice(0, NAMED);
  let dashIndex = 0;
  return all.map((one) => {
    const { name, criterion, color } = one.region;
    const faint = Boolean(criterion) && !near.includes(one);
    return signal(`${name}.clearance`, name, faint ? "gray" : hueOf(color), {
      dash: faint ? [] : DASHES[dashIndex++ % DASHES.length], faint, values: clearanceOf(one.region),
    });
  });
}

/** Return signals of estimates, each with its true value as a dashed line. */
const estimates = (indices) => indices.flatMap((i) => {
  const truth = (run) => {
    const value = run.header.truth?.estimate?.[i];
    return value === undefined ? null : new Float64Array(run.rows).fill(value);
  };
  const line = { dash: [3, 3], context: true, values: truth };
  return [
    signal(`estimate.phi${i + 1}`, `φ${i + 1}`, IN_TURN[i]),
    signal(`truth.phi${i + 1}`, `true φ${i + 1}`, IN_TURN[i], line),
  ];
});

/**
 * Return the charts of some runs, without charts for which no run has a signal.
 *
 * @returns {object[]} with key, title, unit, signals (name, label, hue, shade, dash, faint, context, values(run));
 *   optional are zero (values below 0 are violations), fixed ([least, most]), down (the axis points down)
 */
function chartsOf(runs) {
  const criteria = (kind) => criteriaOf(runs).map(({ name, color }, i) =>
    signal(`${kind}.${name}`, name, hueOf(color), { dash: runDash(i) }));
  const axes = (kind, letters) => inTurn([...letters].map((axis) => `${kind}.${axis}`), [...letters]);
  const size = (kind, label, hue, dash) =>
    signal(`${kind}.size`, label, hue, { dash, values: (run) => sizes(run, kind) });
  const driven = runs.filter((run) => run.header.through === "thrusters"); // the others would stay at 0
  const count = Math.max(0, ...driven.map((run) => run.header.vehicle?.thrusters?.length ?? 0));
  const numbers = Array.from({ length: count }, (_, i) => i + 1);
  const thrusters = inTurn(numbers.map((i) => `thruster_force[${i}]`), numbers.map((i) => `thruster ${i}`));
  const ages = ["autopilot.age", "companion.lateness", "companion.round_trip"];
  const angles = ["roll", "pitch", "yaw"];
  const state = "State of the companion: 5 steers, 6 holds, 7 leaves it to the pilot";
  const charts = [
    ["distances", "Distance to each region", "m", clearances(runs, "m"), { zero: true }],
    ["angles", "Angle to each region of attitude", "rad", clearances(runs, "rad"), { zero: true }],
    ["weights", "Weights of the arbiter", "", criteria("weight"), { fixed: [0, 1] }],
    ["memberships", "Attention that each criterion asks", "", criteria("membership"), { fixed: [0, 1] }],
    ["forces", "Force, size", "N", [
      size("command", "commanded", "vermillion", []), size("actuation", "acts", "blue", [6, 3]),
    ]],
    ["commanded", "Commanded force, body frame", "N", axes("command", "XYZ")],
    ["acting", "Force that acts, body frame", "N", axes("actuation", "XYZ")],
    ["moments", "Commanded moment, body frame", "N.m", axes("command", "KMN")],
    ["turning", "Moment that acts, body frame", "N.m", axes("actuation", "KMN")],
    ["thrusters", "Force of each thruster", "N", thrusters],
    ["estimate", "Estimate of φ1, weight less buoyancy", "N", estimates([0])],
    ["levers", "Estimates of φ2 to φ4, levers of weight", "N.m", estimates([1, 2, 3])],
    ["depth", "Depth", "m", [signal("position.z", "depth", "blue")], { down: true }],
    ["speed", "Velocity over ground, body frame", "m/s", axes("velocity", "uvw")],
    ["attitude", "Attitude", "rad", inTurn(angles.map((angle) => `attitude.${angle}`), angles)],
    ["sticks", "Sticks that were sent", "", axes("stick", "XYZKMN"), { fixed: [-1, 1] }],
    ["targets", "Commanded velocity, NED", "m/s", axes("velocity_target", "xyz")],
    ["ages", "Ages on the autopilot's link", "s", inTurn(ages, ["estimate", "late step", "round trip"])],
    ["states", state, "", [signal("companion.state", "state", "blue")], { fixed: [0, 7] }],
    ["modes", "Mode of the autopilot, its own number", "", [signal("autopilot.mode", "mode", "blue")]],
  ];
  return charts.flatMap(([key, title, unit, all, more]) => {
    const signals = all.filter(({ values }) => runs.some(values));
    return signals.some(({ context }) => !context) ? [{ key, title, unit, signals, ...more }] : [];
  });
}
