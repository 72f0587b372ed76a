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
    const module = await inflated(this.data.wasm);
    const code = new Blob([document.getElementById("flight-worker").textContent], { type: "text/javascript" });
    this._worker = new Worker(URL.createObjectURL(code));
    const { refused } = await this._ask({ module }, [module]);
    if (refused) throw new Error(refused);
  }

  /**
   * Simulate a flight with other numbers.
   * @param {Map<string, number>} values by key
   * @param {?{thruster: number, time: number}} failure an additional one; thrusters count from 1, time [s]
   * @returns {Promise<object>} `rows` and `metrics` of the flight, or {refused}
   */
  async fly(values, failure) {
    const { data } = this;
    const value = (key) => values.get(key) ?? this.slots.get(key)?.value;
    const job = { numbers: [], integers: [], gains: [], starts: [], noise: [...data.noise], metrics: data.metrics };
    job.size = data.rows * Object.keys(data.columns).length;
    for (const [key, x] of values) {
      const { target, offsets } = this.slots.get(key);
      if (target === "noise") job.noise[offsets[0]] = x;
      else if (target === "middle") job.numbers.push(...offsets.map((at) => [at, (x + value(otherEnd(key))) / 2]));
      else if (target === "moved") job.numbers.push(...movedNumbers(this.slots.get(key), x));
      else job[target]?.push(...offsets.map((at) => [at, x]));
    }
    if (failure && data.failures) this._fail(job, failure);
    return this._ask(job);
  }

  /** Add all failures in the order of their steps, and the allocator's numbers once they are reported. */
  _fail({ numbers, integers }, { thruster, time }) {
    const { offsets, own, stages } = this.data.failures;
    const step = Math.ceil(time / this.data.step - 1e-6); // as in cosim/simulation/make_step.py
    const added = [step, thruster - 1, 0];
    const all = [...own, added];
    all.sort((a, b) => a[0] - b[0] || a[1] - b[1] || (a[2] ?? NaN) - (b[2] ?? NaN));
    all.forEach(([at, which, left], i) => {
      integers.push([offsets.failure_steps + i, at], [offsets.failed + i, which]);
      numbers.push([offsets.remaining + i, left ?? NaN]);
    });
    const before = all.filter(([, , left]) => !(left > 0)).indexOf(added); // total failures before it
    stages?.[thruster - 1].slice(before).forEach((arrays, i) => {
      for (const [name, array] of Object.entries(arrays)) {
        const first = offsets[name] + (before + i + 1) * array.length;
        array.forEach((x, k) => numbers.push([first + k, x]));
      }
    });
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
const otherEnd = (key) => key.replace(/\.(start|end)\./, (_, end) => (end === "start" ? ".end." : ".start."));

/** Return the numbers that move with a key, as [index, number], once it has the value `x`. */
const movedNumbers = ({ value, offsets, numbers }, x) =>
  offsets.map((at, i) => [at, numbers[i] === value ? x : numbers[i] + (x - value)]);

/** Return the shifts of the goal to its places in turn [m, NED], from the numbers of `value(key)`. */
function goalPlaces({ places, goal_center: recorded, slots }, value) {
  const center = recorded.map((x, axis) => {
    const [middle, start, end] = ["center", "start", "end"].map((name) => value(`goal.${name}.${axis}`));
    return middle ?? (start === undefined ? x : (start + end) / 2);
  });
  const first = new Map(slots.map(({ key, value: x }) => [key, x]));
  const by = (key) => value(key) - first.get(key);
  const later = places.map(([place, key]) => place.map((x, axis) => x + by(`${key}.${axis}`) - center[axis]));
  return [[0, 0, 0], ...later];
}

const MOST_ROWS = 6000; // limit of the rows of a simulated run; more would not be visible

/**
 * Return the results of a flight as a run.
 *
 * `header` is that of the scenario as flown. `times` [s] are kept as rows where the flight has them.
 */
function runOfFlight(data, { rows: numbers, metrics: { failed_step: refused } }, header, times = []) {
  const rows = refused >= 0 ? Math.max(1, Math.ceil(refused / data.every)) : data.rows;
  const stride = Math.ceil(rows / MOST_ROWS);
  const width = Object.keys(data.columns).length;
  const requestedRows = Array.from(times, (t) => Math.round(t / (data.step * data.every)));
  const isRow = (row, i) => row < rows && numbers[row * width + data.columns.time] === times[i];
  const rowSet = new Set(requestedRows.filter(isRow)).add(rows - 1);
  for (let row = 0; row < rows; row += stride) rowSet.add(row);
  const order = [...rowSet].sort((a, b) => a - b);
  const signals = header.signals.filter(({ name }) => name in data.columns);
  const columns = signals.map(({ name }) => Float64Array.from(order, (row) => numbers[row * width + data.columns[name]]));
  const run = new Run({ ...header, signals }, columns);
  run.column("active").set(activeRegions(run));
  return run;
}

const ASKS = 0.005; // least weight of an active criterion: less is shown as 0.00
const LEADS = 0.5; // least weight with which a criterion leads while the vehicle rests in the goal

/** Return the active region of each row, as in cosim/replay/activity.py. */
function activeRegions(run) {
  const names = run.header.criteria.map(({ name }) => name);
  const criteria = run.header.regions.map(({ criterion }) => names.indexOf(criterion));
  const [weights, memberships] = ["weight", "membership"].map((kind) => run.columns(kind, names));
  const clearances = run.header.regions.map(({ name }) => run.column(`${name}.clearance`));
  const speeds = run.columns("velocity", "uvw");
  return run.time.map((_, row) => {
    if (!names.length) return 0;
    const weight = weights.map((column) => column[row]);
    const leads = weight.reduce((best, x, i) => (x > (weight[best] ?? -Infinity) ? i : best), 0);
    const gap = (region) => clearances[region][row];
    const regions = [...clearances.keys()].filter((i) => criteria[i] === leads && !Number.isNaN(gap(i)));
    if (!regions.length || !(memberships[leads][row] > 0 && weight[leads] >= ASKS)) return 0;
    const region = regions.reduce((a, b) => (gap(b) < gap(a) ? b : a));
    const rests = gap(0) >= 0 && Math.hypot(...speeds.map((speed) => speed[row])) < 0.02;
    return rests && weight[leads] < LEADS && gap(region) >= 0 ? 0 : region;
  });
}
