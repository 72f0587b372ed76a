// Curves of the charts: signals of the runs with names, colors and dashes.

// Colors of Okabe and Ito, darker on white and lighter on black for contrast.
const HUES = {
  light: {
    vermillion: "#d55e00", orange: "#c98800", sky: "#2b87bd", green: "#008a65",
    blue: "#0060a8", purple: "#b3558c", ink: "#1b2733", grey: "#9aa5b0",
  },
  dark: {
    vermillion: "#ff7a33", orange: "#f0b030", sky: "#6cc4f2", green: "#1fc79a",
    blue: "#8fa8ff", purple: "#e79ac8", ink: "#e8eef4", grey: "#5b6a78",
  },
};
// criterion colors of the palette map to hues of the theme; other colors stay
const HUE_OF = { "#D55E00": "vermillion", "#E69F00": "orange", "#56B4E9": "sky", "#CC79A7": "purple", "#009E73": "green" };
const IN_TURN = ["blue", "vermillion", "green", "purple"];
const DASHES = [[], [7, 4], [2, 3], [10, 3, 2, 3], [14, 4], [4, 2, 1, 2, 1, 2]];
const NAMED = 6; // number of regions that the distance chart names

/** Return the dash pattern of a run on a page with several. */
function runDash(index) {
  return DASHES[index % DASHES.length];
}

/** Return the hue name of a header color "#RRGGBB"; the color itself if it has no name. */
function hueOf(colour) {
  return HUE_OF[colour.toUpperCase()] ?? colour;
}

/** Return the criteria of some runs, each name once, in the order of priority. */
function criteriaOf(runs) {
  const found = new Map();
  for (const run of runs) for (const one of run.header.criteria) if (!found.has(one.name)) found.set(one.name, one);
  return [...found.values()];
}

/** Return the CSS color of a hue or of "#rrggbb" in a theme, mixed with the share `shade` of ink. */
function hueColour(hue, theme, shade = 0) {
  const base = HUES[theme][hue] ?? legible(hue, theme);
  if (!shade) return base;
  const [from, to] = [base, HUES[theme].ink].map((hex) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16)));
  return `rgb(${from.map((x, i) => Math.round(x + shade * (to[i] - x))).join(" ")})`;
}

/** Return a signal of a chart; `more` overrides the defaults. */
function signal(name, label, hue, more = {}) {
  return { name, label, hue, shade: 0, dash: [], faint: false, context: false, values: (run) => run.column(name), ...more };
}

/** Return signals with colors in turn; from the fifth on darker and dashed. */
function inTurn(names, labels) {
  const again = { dash: [6, 3], shade: 0.45 };
  return names.map((name, i) => signal(name, labels[i], IN_TURN[i % 4], i < 4 ? {} : again));
}

/** Return a function that computes a signal of a run and caches it until rows are appended. */
function derived(compute) {
  const kept = new WeakMap();
  return (run) => {
    const before = kept.get(run);
    if (before && before.rows === run.rows) return before.values;
    const values = compute(run);
    kept.set(run, { rows: run.rows, values });
    return values;
  };
}

/** Return a function from run to clearances of a region; NaN while a temporary obstacle is absent. */
function clearanceOf({ name, comes }) {
  if (!comes) return (run) => run.column(`${name}.clearance`);
  return derived((run) => {
    const values = run.column(`${name}.clearance`);
    const shifts = ["x", "y", "z"].map((axis) => run.column(`${name}.shift.${axis}`));
    return values && values.map((value, row) => (shifts.some((shift) => shift[row] !== 0) ? value : NaN));
  });
}

/** Return the clearance signals of regions with one unit: the nearest named, the others thin and grey. */
function clearances(runs, unit) {
  const found = new Map();
  for (const run of runs) {
    for (const region of run.header.regions.filter((one) => one.unit === unit)) {
      const values = clearanceOf(region)(run);
      if (!values || (region.comes && !values.some(Number.isFinite))) continue; // no value so far: not added yet
      const before = found.get(region.name) ?? { region, least: Infinity };
      found.set(region.name, { region, least: values.reduce((a, b) => (b < a ? b : a), before.least) });
    }
  }
  const near = [...found.values()].filter(({ region }) => region.criterion).sort((a, b) => a.least - b.least);
  const named = new Set(near.slice(0, NAMED).map(({ region }) => region.name));
  let drawn = 0;
  return [...found.values()].map(({ region }) => {
    const faint = Boolean(region.criterion) && !named.has(region.name);
    return signal(`${region.name}.clearance`, region.name, faint ? "grey" : hueOf(region.colour), {
      dash: faint ? [] : DASHES[drawn++ % DASHES.length],
      faint,
      values: clearanceOf(region),
    });
  });
}

/** Return signals of estimates, each with its true value as a dashed line. */
function estimates(indices) {
  return indices.flatMap((i) => {
    const hue = IN_TURN[i % IN_TURN.length];
    const truth = derived((run) => {
      const value = run.header.truth?.estimate?.[i];
      return value === undefined ? null : new Float64Array(run.rows).fill(value);
    });
    return [
      signal(`estimate.phi${i + 1}`, `φ${i + 1}`, hue),
      signal(`truth.phi${i + 1}`, `true φ${i + 1}`, hue, { dash: [3, 3], context: true, values: truth }),
    ];
  });
}

/**
 * Return the charts of some runs, without charts for which no run has a signal.
 *
 * @returns {object[]} with key, title, unit, signals (name, label, hue, shade, dash, faint, context, values(run)); optional
 *   are zero (values below 0 are violations), fixed ([least, most]), down (the axis points down)
 */
function chartsOf(runs) {
  const criteria = (kind) =>
    criteriaOf(runs).map(({ name, colour }, i) =>
      signal(`${kind}.${name}`, name, hueOf(colour), { dash: DASHES[i % DASHES.length] }),
    );
  const axes = (kind, letters, words = letters) => inTurn([...letters].map((a) => `${kind}.${a}`), [...words]);
  const size = (kind) => derived((run) => sizes(run, ["X", "Y", "Z"].map((axis) => `${kind}.${axis}`)));
  const driven = runs.filter((run) => run.header.through === "thrusters"); // the others would stay at 0
  const thrusters = Math.max(0, ...driven.map((run) => run.header.vehicle?.thrusters?.length ?? 0));
  const numbers = Array.from({ length: thrusters }, (_, i) => i + 1);
  return [
    { key: "distances", title: "Distance to each region", unit: "m", zero: true, signals: clearances(runs, "m") },
    { key: "angles", title: "Angle to each region of attitude", unit: "rad", zero: true, signals: clearances(runs, "rad") },
    { key: "weights", title: "Weights of the arbiter", unit: "", fixed: [0, 1], signals: criteria("weight") },
    { key: "memberships", title: "Attention that each criterion asks", unit: "", fixed: [0, 1], signals: criteria("membership") },
    {
      key: "forces", title: "Force, size", unit: "N",
      signals: [
        signal("command.size", "asked", "vermillion", { values: size("command") }),
        signal("actuation.size", "acts", "blue", { dash: [6, 3], values: size("actuation") }),
      ],
    },
    { key: "asked", title: "Force asked, body frame", unit: "N", signals: axes("command", "XYZ") },
    { key: "acting", title: "Force that acts, body frame", unit: "N", signals: axes("actuation", "XYZ") },
    { key: "moments", title: "Moment asked, body frame", unit: "N.m", signals: axes("command", "KMN") },
    { key: "turning", title: "Moment that acts, body frame", unit: "N.m", signals: axes("actuation", "KMN") },
    {
      key: "thrusters", title: "Force of each thruster", unit: "N",
      signals: inTurn(numbers.map((i) => `thruster_force[${i}]`), numbers.map((i) => `thruster ${i}`)),
    },
    { key: "estimate", title: "Estimate of φ1, weight less buoyancy", unit: "N", signals: estimates([0]) },
    { key: "levers", title: "Estimates of φ2 to φ4, levers of weight", unit: "N.m", signals: estimates([1, 2, 3]) },
    { key: "depth", title: "Depth", unit: "m", down: true, signals: [signal("position.z", "depth", "blue")] },
    { key: "speed", title: "Velocity over ground, body frame", unit: "m/s", signals: axes("velocity", "uvw") },
    {
      key: "attitude", title: "Attitude", unit: "rad",
      signals: inTurn(["attitude.roll", "attitude.pitch", "attitude.yaw"], ["roll", "pitch", "yaw"]),
    },
    { key: "sticks", title: "Sticks that were sent", unit: "", fixed: [-1, 1], signals: axes("stick", "XYZKMN") },
    { key: "targets", title: "Velocity that was asked for, NED", unit: "m/s", signals: axes("velocity_target", "xyz") },
    {
      key: "ages", title: "Ages on the autopilot's link", unit: "s",
      signals: inTurn(["autopilot.age", "companion.lateness", "companion.round_trip"], ["estimate", "late step", "round trip"]),
    },
    {
      key: "states", title: "State of the companion: 5 steers, 6 holds, 7 leaves it to the pilot", unit: "", fixed: [0, 7],
      signals: [signal("companion.state", "state", "blue")],
    },
    { key: "modes", title: "Mode of the autopilot, its own number", unit: "", signals: [signal("autopilot.mode", "mode", "blue")] },
  ].filter((spec) => {
    spec.signals = spec.signals.filter((one) => runs.some((run) => one.values(run)));
    return spec.signals.some((one) => !one.context);
  });
}
