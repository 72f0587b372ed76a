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
    const value = (key) => values.get(key) ?? this.slots.get(key)?.value;
    const sizes = Object.entries(data.widths).map(([name, width]) => [name, width * data.rows]);
    const job = { numbers: [], integers: [], gains: [], starts: [], noise: [...data.noise], metrics: data.metrics };
    job.sizes = Object.fromEntries(sizes);
    for (const [key, x] of values) {
      const put = {
        number: (place) => job.numbers.push([place, x]),
        gain: (place) => job.gains.push([place, x]),
        start: (reference) => job.starts.push([reference, x]),
        middle: (place) => job.numbers.push([place, (x + value(otherEnd(key))) / 2]),
        noise: (place) => {
          job.noise[place] = x;
        },
      };
      for (const [kind, place] of this.slots.get(key).places) put[kind]?.(place);
    }
    goalPlaces(data, value).slice(1).forEach((place, i) => place.forEach((x, axis) => {
      job.numbers.push([this.slots.get(`goal.then.${i}.${axis}`).places[0][1], x]);
    }));
    if (failure && data.failures) this._fail(job, failure);
    return { ...(await this._ask(job)), value };
  }

  /** Add all failures in the order of their steps, and the limits that allocation uses once they are reported. */
  _fail({ numbers, integers }, { thruster, time }) {
    const { failed, steps, remaining, own, reported, lower, upper, limits } = this.data.failures;
    const step = Math.ceil(time / this.data.step - 1e-6); // as in cosim/batch/fused.py
    const all = [...own, [step, thruster - 1, 0]];
    all.sort((a, b) => a[0] - b[0] || a[1] - b[1] || (a[2] ?? NaN) - (b[2] ?? NaN));
    all.forEach(([at, which, left], i) => {
      integers.push([steps + i, at], [failed + i, which]);
      numbers.push([remaining + i, left ?? NaN]);
    });
    if (!reported) return;
    const health = limits[0].map(() => 1);
    all.filter(([, , left]) => !(left > 0)).forEach(([, which], k) => {
      health[which] = 0;
      [lower, upper].forEach(([place, , count], side) => health.forEach((one, i) => {
        numbers.push([place + (k + 1) * count + i, limits[side][i] * one]);
      }));
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

/** Return the shifts of the goal to its places in turn [m, NED], from the numbers of `value(key)`. */
function goalPlaces({ goals, goal_center: recorded }, value) {
  const center = recorded.map((x, axis) => {
    const [middle, start, end] = ["center", "start", "end"].map((name) => value(`goal.${name}.${axis}`));
    return middle ?? (start === undefined ? x : (start + end) / 2);
  });
  const later = Array.from({ length: goals }, (_, i) => center.map((x, axis) => value(`goal.then.${i}.${axis}`) - x));
  return [[0, 0, 0], ...later];
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
  const number = (array, index) => (row) => result[array][row * data.widths[array] + index];
  const time = number("trace", 0);
  const requestedRows = Array.from(times, (t) => Math.round(t / (data.step * data.every)));
  const rowSet = new Set(requestedRows.filter((row, i) => row < rows && time(row) === times[i])).add(rows - 1);
  for (let row = 0; row < rows; row += stride) rowSet.add(row);
  const order = [...rowSet].sort((a, b) => a - b);
  const signals = header.signals.filter(({ name }) => name in data.signals);
  const columns = signals.map(({ name }) => {
    const [kind, ...rest] = data.signals[name];
    const valueAt = SIGNALS[kind]?.(data, rest, number, result.value) ?? number(kind, rest[0]);
    return Float64Array.from(order, (row) => valueAt(row));
  });
  const run = new Run({ ...header, signals }, columns);
  run.column("active")?.set(activeRegions(run, data.criteria));
  return run;
}

/** Functions from row to value of the signals that are no numbers of an array of the worker. */
const SIGNALS = {
  sum(data, [array, first, factors], number) {
    const parts = factors.map((_, i) => number(array, first + i));
    return (row) => factors.reduce((sum, factor, i) => sum + factor * parts[i](row), 0);
  },

  shift(data, [region, axis], number, value) {
    const [time, goalIndex] = [number("trace", 0), number("reasons", data.place)];
    const shifts = goalPlaces(data, value);
    return (row) => data.velocities[region][axis] * time(row) + (region === 0 ? shifts[goalIndex(row)][axis] : 0);
  },

  water({ water: { surface, shear, period, variation } }, [axis], number, value) {
    const [time, depth] = [number("trace", 0), number("trace", 3)];
    const now = value(`plant.current.${axis}`) ?? surface[axis];
    return (row) => {
      const knot = time(row) / period;
      const [before, after] = [Math.floor(knot), Math.ceil(knot)].map((k) => variation[k]?.[axis] ?? 0);
      return now + shear[axis] * Math.max(0, depth(row)) + before + (knot % 1) * (after - before);
    };
  },

  attitude(data, [angle], number) {
    const numbers = [4, 5, 6, 7].map((place) => number("trace", place));
    const angles = {
      roll: (w, x, y, z) => Math.atan2(2 * (w * x + y * z), 1 - 2 * (x ** 2 + y ** 2)),
      pitch: (w, x, y, z) => Math.asin(Math.max(-1, Math.min(1, 2 * (w * y - x * z)))),
      yaw: (w, x, y, z) => Math.atan2(2 * (w * z + x * y), 1 - 2 * (y ** 2 + z ** 2)),
    };
    return (row) => angles[angle](...numbers.map((of) => of(row)));
  },

  active: () => () => 0, // computed afterwards
};

const ASKS = 0.005; // least weight of an active criterion: less is shown as 0.00
const LEADS = 0.5; // least weight with which a criterion leads while the vehicle rests in the goal

/** Return the active region of each row, as in cosim/replay/activity.py. */
function activeRegions(run, criteria) {
  const names = run.header.criteria.map(({ name }) => name);
  const [weights, memberships] = ["weight", "membership"].map((kind) => run.columns(kind, names));
  const clearances = run.header.regions.map(({ name }) => run.column(`${name}.clearance`));
  const speeds = run.columns("velocity", "uvw");
  return run.time.map((_, row) => {
    if (!criteria.length) return 0;
    const weight = weights.map((column) => column[row]);
    const leads = weight.reduce((best, x, i) => (x > (weight[best] ?? -Infinity) ? i : best), 0);
    const gap = (region) => clearances[region][row];
    const regions = [...clearances.keys()].filter((i) => criteria[i - 1] === leads && !Number.isNaN(gap(i)));
    if (!regions.length || !(memberships[leads][row] > 0 && weight[leads] >= ASKS)) return 0;
    const region = regions.reduce((a, b) => (gap(b) < gap(a) ? b : a));
    const rests = gap(0) >= 0 && Math.hypot(...speeds.map((speed) => speed[row])) < 0.02;
    return rests && weight[leads] < LEADS && gap(region) >= 0 ? 0 : region;
  });
}
