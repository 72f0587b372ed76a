// Simulation of the page's scenario with other numbers: inputs of the worker, and its results as a run.

/** Simulation in a worker, one flight at a time. */
class Flight {
  /** @param {object} data as cosim/replay/interactive/data.py makes it */
  constructor(data) {
    this.data = data;
    this.slots = new Map(data.slots.map((slot) => [slot.key, slot]));
  }

  /** Start the worker; reject if the browser has no WebAssembly, or no workers for pages from disk. */
  async start() {
    if (typeof WebAssembly === "undefined") throw new Error("no WebAssembly");
    const packed = Uint8Array.from(atob(this.data.wasm), (letter) => letter.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
    const module = await new Response(stream).arrayBuffer();
    const code = new Blob([document.getElementById("flier").textContent], { type: "text/javascript" });
    this._worker = new Worker(URL.createObjectURL(code));
    const { refused } = await this._ask({ module }, [module]);
    if (refused) throw new Error(refused);
  }

  /**
   * Simulate a flight with other numbers.
   * @param {Map<string, number>} values by key
   * @param {?{thruster: number, time: number}} failure an additional one; thrusters count from 1, time [s]
   * @returns {Promise<object>} arrays of the worker, or {refused}; and value(key), the number that was flown
   */
  async fly(values, failure) {
    const { data } = this;
    const job = { numbers: [], integers: [], gains: [], starts: [], noise: [...data.noise], metrics: data.metrics, sizes: {} };
    for (const [name, width] of Object.entries(data.widths)) job.sizes[name] = width * data.rows;
    const to = { number: job.numbers, gain: job.gains, start: job.starts };
    for (const [key, value] of values) {
      for (const [kind, place] of this.slots.get(key).places) {
        if (kind === "noise") job.noise[place] = value;
        else if (kind === "middle") job.numbers.push([place, (value + (values.get(otherEnd(key)) ?? this.slots.get(otherEnd(key)).value)) / 2]);
        else to[kind]?.push([place, value]);
      }
    }
    const value = (key) => values.get(key) ?? this.slots.get(key)?.value;
    for (const [i, place] of goalPlaces(data, value).slice(1).entries()) {
      place.forEach((x, axis) => job.numbers.push([this.slots.get(`goal.then.${i}.${axis}`).places[0][1], x]));
    }
    if (failure && data.failures) this._fail(job, failure);
    return { ...(await this._ask(job)), value };
  }

  /** Add all failures in the order of their steps, and the limits that allocation uses once they are reported. */
  _fail({ numbers, integers }, { thruster, time }) {
    const { failed, steps, remaining, own, reported, lower, upper, limits } = this.data.failures;
    const step = Math.ceil(time / this.data.step - 1e-6); // as in cosim/batch/fused.py
    const all = [...own, [step, thruster - 1, 0]].sort((a, b) => a[0] - b[0] || a[1] - b[1] || (a[2] ?? NaN) - (b[2] ?? NaN));
    all.forEach(([at, which, left], i) => {
      integers.push([steps + i, at], [failed + i, which]);
      numbers.push([remaining + i, left ?? NaN]);
    });
    if (!reported) return;
    const health = limits[0].map(() => 1);
    let stage = 0;
    for (const [, which, left] of all) {
      if (left > 0) continue;
      health[which] = 0;
      stage += 1;
      [lower, upper].forEach(([place, , count], side) => health.forEach((h, i) => numbers.push([place + stage * count + i, limits[side][i] * h])));
    }
  }

  _ask(message, transfer = []) {
    return new Promise((settled, failed) => {
      this._worker.onmessage = ({ data }) => settled(data);
      this._worker.onerror = (event) => failed(new Error(event.message || "no worker"));
      this._worker.postMessage(message, transfer);
    });
  }
}

/** Return the key of a cylinder's other end. */
function otherEnd(key) {
  return key.includes(".start.") ? key.replace(".start.", ".end.") : key.replace(".end.", ".start.");
}

/** Return the shifts of the goal to its places in turn [m, NED], from the numbers of `value(key)`. */
function goalPlaces(data, value) {
  const center = data.goal_center.map((x, axis) => {
    const [middle, start, end] = ["centre", "start", "end"].map((name) => value(`goal.${name}.${axis}`));
    return middle ?? (start === undefined ? x : (start + end) / 2);
  });
  const shift = (i) => center.map((x, axis) => value(`goal.then.${i}.${axis}`) - x);
  return [[0, 0, 0], ...Array.from({ length: data.goals }, (_, i) => shift(i))];
}

const MOST_ROWS = 6000; // limit of the rows of a simulated run; more would not be visible

/**
 * Return the results of a flight as a run.
 *
 * `header` is that of the scenario as flown. `times` [s] are kept as rows where the flight has them.
 */
function runOfFlight(data, result, header, times = []) {
  const refused = result.metrics[12];
  const rows = refused >= 0 ? Math.max(1, Math.ceil(refused / data.every)) : data.rows;
  const stride = Math.ceil(rows / MOST_ROWS);
  const number = (array, place) => (row) => result[array][row * data.widths[array] + place];
  const time = number("trace", 0);
  const asked = Array.from(times, (t) => Math.round(t / (data.step * data.every))).filter((row, i) => row < rows && time(row) === times[i]);
  const even = Array.from({ length: Math.ceil(rows / stride) }, (_, i) => i * stride);
  const kept = [...new Set([...even, ...asked, rows - 1])].sort((a, b) => a - b);
  const signals = header.signals.filter(({ name }) => name in data.signals);
  const columns = signals.map(({ name }) => Float64Array.from(kept, signalOf(data, data.signals[name], number, result.value)));
  const run = new Run({ ...header, signals }, columns);
  const active = signals.findIndex((signal) => signal.name === "active");
  if (active >= 0) columns[active].set(activeRegions(run, data.criteria));
  return run;
}

/** Return a function from row to value of a signal; 0 for the active region, which is computed afterwards. */
function signalOf(data, [kind, ...rest], number, value) {
  if (kind === "sum") {
    const [array, first, factors] = rest;
    const parts = factors.map((_, i) => number(array, first + i));
    return (row) => factors.reduce((sum, factor, i) => sum + factor * parts[i](row), 0);
  }
  if (kind === "shift") {
    const [region, axis] = rest;
    const [time, place] = [number("trace", 0), number("reasons", data.place)];
    const places = goalPlaces(data, value);
    return (row) => data.velocities[region][axis] * time(row) + (region === 0 ? places[place(row)][axis] : 0);
  }
  if (kind === "water") {
    const [axis] = rest;
    const { surface, shear, period, variation } = data.water;
    const [time, depth] = [number("trace", 0), number("trace", 3)];
    const now = value(`plant.current.${axis}`) ?? surface[axis];
    return (row) => {
      const knot = time(row) / period;
      const [before, after] = [Math.floor(knot), Math.ceil(knot)].map((k) => variation[k]?.[axis] ?? 0);
      return now + shear[axis] * Math.max(0, depth(row)) + before + (knot % 1) * (after - before);
    };
  }
  if (kind === "attitude") {
    const [w, x, y, z] = [4, 5, 6, 7].map((place) => number("trace", place));
    return {
      roll: (row) => Math.atan2(2 * (w(row) * x(row) + y(row) * z(row)), 1 - 2 * (x(row) ** 2 + y(row) ** 2)),
      pitch: (row) => Math.asin(Math.max(-1, Math.min(1, 2 * (w(row) * y(row) - x(row) * z(row))))),
      yaw: (row) => Math.atan2(2 * (w(row) * z(row) + x(row) * y(row)), 1 - 2 * (y(row) ** 2 + z(row) ** 2)),
    }[rest[0]];
  }
  return kind === "active" ? () => 0 : number(kind, rest[0]);
}

const ASKS = 0.005; // least weight of an active criterion: less is shown as 0.00
const LEADS = 0.5; // least weight with which a criterion leads while the vehicle rests in the goal

/** Return the active region of each row, as in cosim/replay/activity.py. */
function activeRegions(run, criteria) {
  const column = (name) => run.column(name);
  const names = run.header.criteria.map(({ name }) => name);
  const [weights, memberships] = ["weight", "membership"].map((kind) => names.map((name) => column(`${kind}.${name}`)));
  const clearances = run.header.regions.map(({ name }) => column(`${name}.clearance`));
  const speeds = ["u", "v", "w"].map((axis) => column(`velocity.${axis}`));
  return run.time.map((_, row) => {
    if (!criteria.length) return 0;
    const leads = weights.reduce((best, weight, i) => (weight[row] > (weights[best][row] ?? -Infinity) ? i : best), 0);
    let region = 0;
    criteria.forEach((of, i) => {
      const gap = clearances[i + 1][row];
      if (of === leads && !Number.isNaN(gap) && !(region && gap >= clearances[region][row])) region = i + 1;
    });
    if (!region || !(memberships[leads][row] > 0 && weights[leads][row] >= ASKS)) return 0;
    const rests = clearances[0][row] >= 0 && Math.hypot(...speeds.map((speed) => speed[row])) < 0.02;
    return rests && weights[leads][row] < LEADS && clearances[region][row] >= 0 ? 0 : region;
  });
}
