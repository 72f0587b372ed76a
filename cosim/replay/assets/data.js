// Runs of the page: recorded signals, and their values at any time.

/** One run: its header, and a Float64Array for each signal. */
class Run {
  /** @param {object} header as cosim/replay/header.py makes it  @param {Float64Array[]} columns one for each signal */
  constructor(header, columns) {
    this.header = header;
    this.rows = columns[0]?.length ?? 0;
    this._index = new Map(header.signals.map(({ name }, i) => [name, i]));
    this._columns = columns;
    this._capacity = this.rows;
  }

  /** Return a run with the same columns and another header of the same signals. */
  withHeader(header) {
    return new Run(header, this._columns.map((column) => column.subarray(0, this.rows)));
  }

  /** Return the times of all rows [s], increasing. */
  get time() { return this.column("time"); }

  /** Return the first time [s]; 0 without rows. */
  get start() { return this.rows ? this.time[0] : 0; }

  get end() { return this.rows ? this.time[this.rows - 1] : 0; }

  has(name) { return this._index.has(name); }

  /** Return the values of a signal, one for each row; null if there is no such signal. */
  column(name) { return this.has(name) ? this._columns[this._index.get(name)].subarray(0, this.rows) : null; }

  /** Return the columns of a vector, such as "position". */
  columns(name, axes = "xyz") { return [...axes].map((axis) => this.column(`${name}.${axis}`)); }

  /** Return the index of the last row at or before a time [s]; 0 before the first row. */
  row(t) {
    const time = this._columns[this._index.get("time")];
    let [low, high] = [0, this.rows];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (time[middle] <= t) low = middle;
      else high = middle;
    }
    return low;
  }

  /** Return a signal at a time [s] as of the last row before it, for values that switch. */
  held(name, t) { return this.column(name)?.[this.row(t)] ?? NaN; }

  /** Return a signal at a time [s], interpolated between rows, for values that move. */
  at(name, t) {
    const column = this.column(name);
    if (!column || !this.rows) return NaN;
    const [i, part] = this._between(t);
    return part > 0 ? column[i] + part * (column[i + 1] - column[i]) : column[i];
  }

  /** Return a vector at a time [s] as held(). */
  vectorHeld(name, t, axes = "xyz") { return [...axes].map((axis) => this.held(`${name}.${axis}`, t)); }

  /** Return a vector at a time [s] as at(). */
  vectorAt(name, t) { return [..."xyz"].map((axis) => this.at(`${name}.${axis}`, t)); }

  /** Return the pose at a time [s]: position [m, NED], and quaternion from body to world, scalar first. */
  pose(t) {
    const [i, part] = this._between(t);
    const columns = this.columns("quaternion", ["e0", "e1", "e2", "e3"]);
    let quaternion = columns.map((column) => column[i]);
    if (part > 0) {
      const next = columns.map((column) => column[i + 1]);
      const sign = quaternion.reduce((sum, x, k) => sum + x * next[k], 0) < 0 ? -1 : 1;
      quaternion = quaternion.map((x, k) => x + part * (sign * next[k] - x));
      const norm = Math.hypot(...quaternion);
      quaternion = quaternion.map((x) => x / norm);
    }
    return { position: this.vectorAt("position", t), quaternion };
  }

  /** Return the index of the goal's place at a time [s], of those that it has in turn; 0 for a goal with one. */
  goalPlace(t) { return this.held("goal.place", t) || 0; }

  /**
   * Return the displacement of a region from its shape's place at a time [s] [m, NED]; with `place`, that of the goal
   * at one of its places.
   */
  shift(region, t, place = null) {
    const { name, is_dynamic: isDynamic, places } = this.header.regions[region];
    if (places && place !== null && place !== this.goalPlace(t)) return places[place];
    if (places) return this.vectorHeld(`${name}.shift`, t); // it leaps between places
    if (!this.has(`${name}.shift.x`)) return [0, 0, 0];
    // do not interpolate between the parked position and the scene
    const next = Math.min(this.row(t) + 1, this.rows - 1);
    const leaps = isDynamic && !(this.there(region, t) && this._isThere(region, next));
    return leaps ? this.vectorHeld(`${name}.shift`, t) : this.vectorAt(`${name}.shift`, t);
  }

  /** Return the velocity of the water at the vehicle [m/s, NED] as of a time [s]; null at rest, or if not known. */
  current(t) {
    const velocity = this.vectorHeld("water_velocity", t);
    return Vec.norm(velocity) >= 0.0005 && Vec.finite(velocity) ? velocity : null; // less is shown as 0
  }

  /** Return true if a region moves at a time [s]: between the rows about it, or the last two. */
  moves(region, t) {
    const row = Math.min(this.row(t), this.rows - 2);
    const { name, places } = this.header.regions[region];
    if (!(row >= 0) || places || !this.has(`${name}.shift.x`) || !this._isThere(region, row)) return false;
    return Vec.distance(this.shift(region, this.time[row]), this.shift(region, this.time[row + 1])) > 0;
  }

  /** Return true if a region exists at a time [s]; obstacles that are reported during the run come and go. */
  there(region, t) { return this._isThere(region, this.row(t)); }

  /** Return the shape of a region at a time [s]; header.changes has later shapes in the order of time. */
  shape(region, t) {
    const last = this.header.changes?.findLast((change) => change.region === region && change.time <= t);
    return (last ?? this.header.regions[region]).shape;
  }

  /** Return the index of the active region at a time [s]; 0 is the goal. */
  active(t) { return this.held("active", t) || 0; }

  /** Return the time [s] after which pose and active region stay as at the end and no event follows, plus 5 %. */
  get rest() {
    const last = this.rows - 1;
    const position = this.columns("position").filter(Boolean);
    const ends = [Math.min, Math.max].map((f) => position.map((column) => column.reduce((a, b) => f(a, b), column[0])));
    const limits = [ // column, and the change below which it rests
      ...position.map((column) => [column, 0.02 * Math.hypot(...ends[1].map((x, i) => x - ends[0][i]))]),
      ...this.columns("quaternion", ["e0", "e1", "e2", "e3"]).map((column) => [column, 0.05]),
      [this.column("active"), 0],
    ].filter(([column]) => column);
    let row = last;
    while (row > 0 && limits.every(([column, limit]) => Math.abs(column[row - 1] - column[last]) <= limit)) row -= 1;
    const events = (this.header.events ?? []).filter(({ kind }) => kind !== "end");
    const times = events.flatMap(({ time, until }) => [time, until ?? time]);
    const restStart = Math.max(this.rows ? this.time[row] : 0, ...times);
    return restStart + 0.05 * (restStart - this.start);
  }

  /** Append one row of a live run, in the order of the header's signals. */
  append(row) {
    if (this.rows === this._capacity) {
      this._capacity = Math.max(1024, 2 * this._capacity);
      this._columns = this._columns.map((column) => {
        const wider = new Float64Array(this._capacity);
        wider.set(column.subarray(0, this.rows));
        return wider;
      });
    }
    row.forEach((value, i) => {
      this._columns[i][this.rows] = value;
    });
    this.rows += 1;
  }

  _isThere(region, row) {
    const { name, is_dynamic: isDynamic } = this.header.regions[region];
    // an imported log has no goal, hence no shift of one
    return !isDynamic || this.columns(`${name}.shift`).some((column) => column && column[row] !== 0);
  }

  /** Return the row before a time, and the part of the way to the next one. */
  _between(t) {
    const i = this.row(t);
    if (i + 1 >= this.rows) return [i, 0];
    const { time } = this;
    return [i, Math.min(1, Math.max(0, (t - time[i]) / (time[i + 1] - time[i])))];
  }
}

/** Unpack bytes: base64, raw deflate. */
async function inflated(base64) {
  const packed = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Response(stream).arrayBuffer();
}

/** Unpack the numbers of a run: byte planes, columns. */
async function unpacked(header) {
  const planes = new Uint8Array(await inflated(header.data));
  const count = planes.length / 8;
  const bytes = planes.map((_, i) => planes[(i % 8) * count + (i >> 3)]);
  const numbers = new Float64Array(bytes.buffer); // little-endian, as all machines with browsers are
  return new Run(header, header.signals.map((_, i) => numbers.subarray(i * header.rows, (i + 1) * header.rows)));
}

/** Unpack all runs of the page. */
async function loadRuns() {
  return Promise.all(JSON.parse(document.getElementById("runs").textContent).map(unpacked));
}
