// What-if simulation: the page's run with other numbers, beside the recorded run.

const LATER = 120; // ms, delay after the last change of a number

/** Scenario with the numbers that the reader has changed, and its simulation. */
class WhatIf {
  /** @param {Page} page  @param {Run} recorded  @param {Flight} flight after start() */
  constructor(page, recorded, flight) {
    Object.assign(this, { page, recorded, flight, values: new Map(), failure: null, flown: false, repeats: null });
    this.run = recorded; // with its regions at their current positions, for dragging
    this.panel = new WhatIfPanel(this);
    this.dragging = new Dragging(this);
  }

  // ---- interface for Dragging ----

  get acceptsCommands() { return true; }

  get refusal() { return ""; }

  get time() { return this.page.player.t; }

  canMove(region, place) { return this._movable(region, place) !== undefined; }

  /** Return what can be moved, each place of the goal by itself: {region, place, name, axes: keys of each axis}. */
  movable() {
    const { moves, places } = this.flight.data;
    const all = this.recorded.header.regions.flatMap((of, region) =>
      Array.from({ length: region || !places.length ? 1 : places.length + 1 }, (_, place) => {
        const later = place ? [0, 1, 2].map((axis) => [`${places[place - 1][1]}.${axis}`]) : null;
        return { region, place, name: regionName(of, place), axes: later ?? moves[region] };
      }));
    return all.filter(({ axes }) => axes);
  }

  /** Return what can be moved, of places that move together, as rings do, the first. */
  groups() {
    const keyOf = ({ axes }) => axes.flat()[0];
    return this.movable().filter((one, i, all) => all.findIndex((other) => keyOf(other) === keyOf(one)) === i);
  }

  /** Move a region, or the goal's later `place`, from one point to another [m, NED]. */
  move(region, from, to, place) {
    const by = Vec.sub(to, from);
    this._movable(region, place).axes.forEach((keys, axis) => {
      if (!by[axis]) return;
      const values = keys.map((key) => this.value(key));
      // move both ends of a cylinder by exactly the same step, so that its length stays
      const along = this.flight.slots.get(keys[0])?.target === "middle" && values[0] !== values[1];
      const step = Math.round(1024 * by[axis]) / 1024;
      const shifted = (value) => (along ? value + step : Number((value + by[axis]).toFixed(4)));
      keys.forEach((key, i) => this._put(key, shifted(values[i])));
    });
    this.later(0);
  }

  _movable(region, place) { return this.movable().find((one) => one.region === region && one.place === (place ?? 0)); }

  // ---- numbers ----

  /** Return the current number of a key; undefined for one that the page cannot change. */
  value(key) { return this.values.get(key) ?? this.flight.slots.get(key)?.value; }

  set(key, value) {
    this._put(key, value);
    this.later();
  }

  /** Set the additional failure: thruster (from 1) and time [s]; null for none. */
  fail(failure) {
    this.failure = failure;
    this.later();
  }

  get changed() { return this.values.size > 0 || this.failure !== null; }

  /** Restore the recorded scenario. */
  reset() {
    this.values.clear();
    this.failure = null;
    this.later(0);
  }

  _put(key, value) {
    if (value === this.flight.slots.get(key).value) this.values.delete(key);
    else this.values.set(key, value);
  }

  /** Return by how much a key differs from the record. */
  _change(key) { return this.flight.slots.has(key) ? this.value(key) - this.flight.slots.get(key).value : 0; }

  // ---- flights ----

  /** Schedule a simulation after `wait` [ms]; one that runs already is completed first. */
  later(wait = LATER) {
    this.run = this.recorded.withHeader(this._header());
    this.panel.update();
    clearTimeout(this._next);
    this._next = setTimeout(() => this._fly(), wait);
  }

  async _fly() {
    this._again = this._flying;
    if (this._flying) return;
    this._flying = true;
    this.panel.say("flying …");
    const { failure, changed } = this;
    const header = this._header();
    const result = await this.flight.fly(new Map(this.values), failure);
    this._flying = false;
    this.last = result;
    if (result.refused) {
      this.page.say(`These numbers cannot be flown: ${result.refused}`, "error");
      this.panel.say("refused");
    } else {
      const run = runOfFlight(this.flight.data, result, header, changed ? [] : this.recorded.time);
      Object.assign(run.header, outcomeOf(this.flight.data, result, run, failure));
      this._show(run, result, changed);
    }
    if (this._again) this._fly();
  }

  _show(run, { took }, changed) {
    this.took = took;
    this.page.say("");
    const asRecorded = this.recorded.withHeader({ ...this.recorded.header, name: "as recorded" });
    if (!changed) {
      this._compare(run);
      this._refine(run);
      if (this.page.runs.length > 1) this.page.show([this.recorded], true);
    } else if (this.flown) this.page.replace([asRecorded, run]);
    else {
      this.page.show([asRecorded, run], true);
      this.page.select(1);
    }
    this.flown = changed;
    const repeats = this.repeats === 0 ? "to the last bit" : `within ${this.repeats?.toExponential(0)} m`;
    this.panel.say(changed ? `flown in ${decimals(took / 1000, 2)} s` : `as recorded, ${repeats}`);
  }

  /** Store the largest position difference [m] to the record, for a simulation of the same numbers. */
  _compare(run) {
    const { recorded } = this;
    const [columns, others] = [run, recorded].map((one) => one.columns("position"));
    const differences = Array.from(recorded.time, (t, i) => {
      const row = run.row(t);
      return run.time[row] === t ? columns.map((column, axis) => Math.abs(column[row] - others[axis][i])) : [];
    });
    this.repeats = differences.flat().reduce((a, b) => Math.max(a, b), 0);
  }

  /** Replace the recorded run by its simulation, which has more rows, if both are equal. */
  _refine(run) {
    const { recorded } = this;
    const { step, every } = this.flight.data; // the simulation has a row for each decision, the record for each step
    const isComplete = recorded.end - run.end <= step * every;
    const isFiner = isComplete && run.rows > recorded.rows && run.header.signals.length === recorded.header.signals.length;
    if (this.repeats !== 0 || !isFiner) return;
    this.recorded = this.run = run.withHeader(recorded.header);
    if (this.page.runs.length === 1) this.page.replace([this.recorded]);
  }

  /** Return the header of the recorded run with the current numbers. */
  _header() {
    const { header } = this.recorded;
    const { moves, restoring } = this.flight.data;
    const regions = header.regions.map((region, i) => {
      const by = (moves[i] ?? []).map(([key]) => (key ? this._change(key) : 0));
      return by.some((x) => x !== 0) ? { ...region, shape: movedShape(region.shape, by) } : region;
    });
    const [goal] = regions;
    if (goal.places) regions[0] = { ...goal, places: goalPlaces(this.flight.data, (key) => this.value(key)) };
    const change = this._change(restoring.key);
    const truth = { ...header.truth, estimate: restoring.truth.map((phi, i) => phi + change * restoring.slopes[i]) };
    const task = this.changed ? `With ${this.words().join(", ")}.` : header.task;
    return { ...header, name: "what if", task, regions, truth, changes: [], gaps: {} };
  }

  /** Return the changes as texts. */
  words() {
    const movable = this.groups();
    const draggedRegions = movable.filter(({ axes }) => axes.flat().some((key) => this.values.has(key)));
    const placed = new Set(movable.flatMap(({ axes }) => axes.flat()));
    const numbers = [...this.values].filter(([key]) => !placed.has(key)).map(([key, value]) => {
      const { words, unit } = this.flight.slots.get(key);
      return `${words} ${shortNumber(value)} ${unit}`.trim();
    });
    const failed = this.failure ? [`thruster ${this.failure.thruster} failing at ${this.failure.time} s`] : [];
    return [...draggedRegions.map(({ name }) => `${name} moved`), ...numbers, ...failed];
  }
}

/** Return a shape of a header, moved by `by` [m, NED]. */
function movedShape(shape, by) {
  const add = (point) => point.map((x, axis) => x + by[axis]);
  const all = (points) => points.map(add);
  const deeper = (depth) => depth + by[2];
  const moves = {
    center: add, feature: add, point: add, start: add, end: add, points: all, corners: all,
    top: deeper, bottom: deeper, depth: deeper,
    drawing: (drawing) => movedShape(drawing, by),
    planes: (planes) => planes.map((plane) => movedShape(plane, by)),
  };
  const entries = Object.entries(shape).filter(([, value]) => value !== null);
  const shifted = entries.map(([key, value]) => [key, moves[key]?.(value) ?? value]);
  return Object.fromEntries(shifted);
}

/** Start the what-if simulation if the page has one and the browser can run it; else return null. */
async function startWhatIf(page) {
  const data = JSON.parse(byId("flight").textContent);
  if (!data || page.runs.length !== 1) return null;
  const flight = new Flight(data);
  try {
    await flight.start();
  } catch (error) {
    page.say(`This browser shows the run, but cannot fly it again: ${error.message}.`, "info");
    return null;
  }
  const whatIf = new WhatIf(page, page.runs[0], flight);
  page.setKeys(keysOf(page, whatIf));
  whatIf.later(0);
  return whatIf;
}
