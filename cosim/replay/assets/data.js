// Runs of the page: recorded signals, and their values at any time.

/** One run: its header, and a Float64Array for each signal. */
class Run {
  /** @param {object} header as cosim/replay/header.py makes it  @param {Float64Array[]} columns one for each signal */
  constructor(header, columns) {
    this.header = header;
    this.rows = columns.length ? columns[0].length : 0;
    this._at = new Map(header.signals.map((signal, i) => [signal.name, i]));
    this._columns = columns;
    this._room = this.rows;
  }

  /** Return a run with the same columns and another header of the same signals. */
  withHeader(header) {
    return new Run(header, this._columns.map((column) => column.subarray(0, this.rows)));
  }

  /** Return the times of all rows [s], increasing. */
  get time() {
    return this.column("time");
  }

  /** Return the first time [s]; 0 without rows. */
  get start() {
    return this.rows ? this.time[0] : 0;
  }

  get end() {
    return this.rows ? this.time[this.rows - 1] : 0;
  }

  has(name) {
    return this._at.has(name);
  }

  /** Return the values of a signal, one for each row; null if there is no such signal. */
  column(name) {
    const at = this._at.get(name);
    return at === undefined ? null : this._columns[at].subarray(0, this.rows);
  }

  unit(name) {
    return this.header.signals[this._at.get(name)].unit;
  }

  /** Return the index of the last row at or before a time [s]; 0 before the first row. */
  row(t) {
    const at = this._at.get("time");
    const time = this._columns[at];
    let low = 0;
    let high = this.rows;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (time[middle] <= t) low = middle;
      else high = middle;
    }
    return low;
  }

  /** Return a signal at a time [s] as of the last row before it, for values that switch. */
  held(name, t) {
    const column = this.column(name);
    return column ? column[this.row(t)] : NaN;
  }

  /** Return a signal at a time [s], interpolated between rows, for values that move. */
  at(name, t) {
    const column = this.column(name);
    if (!column || !this.rows) return NaN;
    const [i, part] = this._between(t);
    return part > 0 ? column[i] + part * (column[i + 1] - column[i]) : column[i];
  }

  /** Return the pose at a time [s]: position [m, NED], and quaternion from body to world, scalar first. */
  pose(t) {
    const [i, part] = this._between(t);
    const position = ["x", "y", "z"].map((axis) => this.at(`position.${axis}`, t));
    const columns = ["e0", "e1", "e2", "e3"].map((e) => this.column(`quaternion.${e}`));
    let quaternion = columns.map((column) => column[i]);
    if (part > 0) {
      const next = columns.map((column) => column[i + 1]);
      const sign = quaternion.reduce((sum, x, k) => sum + x * next[k], 0) < 0 ? -1 : 1;
      quaternion = quaternion.map((x, k) => x + part * (sign * next[k] - x));
      const norm = Math.hypot(...quaternion);
      quaternion = quaternion.map((x) => x / norm);
    }
    return { position, quaternion };
  }

  /** Return the index of the goal's place at a time [s], of those that it has in turn; 0 for a goal with one. */
  goalPlace(t) {
    return this.held("goal.place", t) || 0;
  }

  /**
   * Return the displacement of a region from its shape's place at a time [s] [m, NED]; with `place`, that of the goal at
   * one of its places.
   */
  shift(region, t, place = null) {
    const { name, comes, places } = this.header.regions[region];
    if (places) return places[place ?? this.goalPlace(t)];
    if (!this.has(`${name}.shift.x`)) return [0, 0, 0];
    const names = ["x", "y", "z"].map((axis) => `${name}.shift.${axis}`);
    // do not interpolate between the parked position and the scene
    const leaps = comes && !(this.there(region, t) && this._isThere(region, Math.min(this.row(t) + 1, this.rows - 1)));
    return names.map((signal) => (leaps ? this.held(signal, t) : this.at(signal, t)));
  }

  /** Return the velocity of the water at the vehicle [m/s, NED] as of a time [s]; null at rest, or if it is not known. */
  current(t) {
    const velocity = ["x", "y", "z"].map((axis) => this.held(`water_velocity.${axis}`, t));
    return Vec.finite(velocity) && Vec.norm(velocity) >= 0.0005 ? velocity : null; // less is shown as 0
  }

  /** Return true if a region moves at a time [s]: between the rows about it, or the last two. */
  moves(region, t) {
    const row = Math.min(this.row(t), this.rows - 2);
    if (!(row >= 0) || this.header.regions[region].places || !this.has(`${this.header.regions[region].name}.shift.x`)) return false;
    const [a, b] = [row, row + 1].map((i) => this.shift(region, this.time[i]));
    return this._isThere(region, row) && Vec.norm(Vec.sub(a, b)) > 0;
  }

  /** Return true if a region exists at a time [s]; obstacles that are reported during the run come and go. */
  there(region, t) {
    return this._isThere(region, this.row(t));
  }

  /** Return the shape of a region at a time [s]; header.changes has later shapes in the order of time. */
  shape(region, t) {
    let shape = this.header.regions[region].shape;
    for (const change of this.header.changes ?? []) {
      if (change.region === region && change.time <= t) shape = change.shape;
    }
    return shape;
  }

  /** Return the index of the active region at a time [s]; 0 is the goal. */
  active(t) {
    const index = this.held("active", t);
    return Number.isFinite(index) ? index : 0;
  }

  /** Return the time [s] after which pose and active region stay as at the end and no event follows, plus 5 %. */
  get rest() {
    if (this._rest?.rows === this.rows) return this._rest.time;
    const all = (names) => names.map((name) => this.column(name)).filter(Boolean);
    const last = this.rows - 1;
    const near = (columns, most) => (i) => columns.every((column) => Math.abs(column[i] - column[last]) <= most);
    const places = all(["x", "y", "z"].map((axis) => `position.${axis}`));
    const way = Math.hypot(...places.map((x) => x.reduce((a, b) => Math.max(a, b), -Infinity) - x.reduce((a, b) => Math.min(a, b), Infinity)));
    const still = [
      near(places, 0.02 * way), near(all([0, 1, 2, 3].map((e) => `quaternion.e${e}`)), 0.05), near(all(["active"]), 0),
    ];
    let row = last;
    while (row > 0 && still.every((rests) => rests(row - 1))) row -= 1;
    const events = (this.header.events ?? []).filter(({ kind }) => kind !== "end").flatMap(({ time, until }) => [time, until ?? time]);
    const time = Math.max(this.rows ? this.time[row] : 0, ...events);
    this._rest = { rows: this.rows, time: time + 0.05 * (time - this.start) };
    return this._rest.time;
  }

  /** Append one row of a live run, in the order of the header's signals. */
  append(row) {
    if (this.rows === this._room) {
      this._room = Math.max(1024, 2 * this._room);
      this._columns = this._columns.map((column) => {
        const wider = new Float64Array(this._room);
        wider.set(column.subarray(0, this.rows));
        return wider;
      });
    }
    for (let i = 0; i < row.length; i++) this._columns[i][this.rows] = row[i];
    this.rows += 1;
  }

  _isThere(region, row) {
    const { name, comes } = this.header.regions[region];
    // an imported log has no goal, hence no shift of one
    return !comes || (this.has(`${name}.shift.x`) && ["x", "y", "z"].some((axis) => this.column(`${name}.shift.${axis}`)[row] !== 0));
  }

  _between(t) {
    const i = this.row(t);
    if (i + 1 >= this.rows) return [i, 0];
    const time = this.column("time");
    return [i, Math.min(1, Math.max(0, (t - time[i]) / (time[i + 1] - time[i])))];
  }
}

/** Unpack the numbers of a run: base64, raw deflate, byte planes, columns. */
async function unpacked(header) {
  const packed = Uint8Array.from(atob(header.data), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  const count = planes.length / 8;
  const bytes = new Uint8Array(planes.length);
  for (let plane = 0; plane < 8; plane++) {
    for (let i = 0; i < count; i++) bytes[8 * i + plane] = planes[plane * count + i];
  }
  const numbers = new Float64Array(bytes.buffer); // little-endian, as all machines with browsers are
  const columns = header.signals.map((_, i) => numbers.subarray(i * header.rows, (i + 1) * header.rows));
  return new Run(header, columns);
}

/** Unpack all runs of the page. */
async function loadRuns() {
  const headers = JSON.parse(document.getElementById("runs").textContent);
  return Promise.all(headers.map(unpacked));
}
