// What-if simulation: the page's run with other numbers, beside the recorded run.

const LATER = 120; // ms, delay after the last change of a number

/** Scenario with the numbers that the reader has changed, and its simulation. */
class WhatIf {
  /** @param {Page} page  @param {Run} recorded  @param {Flight} flight after start() */
  constructor(page, recorded, flight) {
    Object.assign(this, { page, recorded, flight, values: new Map(), failure: null, flown: null, repeats: null });
    this.run = recorded; // with its regions at their current positions, for dragging
    this.panel = new WhatIfPanel(this);
    this.dragging = new Dragging(this);
  }

  // ---- interface for Dragging ----

  get acceptsCommands() {
    return true;
  }

  get refusal() {
    return "";
  }

  get time() {
    return this.page.player.t;
  }

  canMove(region, place) {
    return this.movable().some((one) => one.region === region && one.place === (place ?? 0));
  }

  /** Return what can be moved, each place of the goal by itself: {region, place, name, axes}, with the keys of each axis. */
  movable() {
    const { moves, goals } = this.flight.data;
    return this.recorded.header.regions.flatMap((region, index) =>
      Array.from({ length: index || !goals ? 1 : goals + 1 }, (_, place) => ({
        region: index, place, name: regionName(region, place),
        axes: place ? [0, 1, 2].map((axis) => [`goal.then.${place - 1}.${axis}`]) : moves[index],
      })).filter(({ axes }) => axes),
    );
  }

  /** Move a region, or the goal's later `place`, from one point to another [m, NED]. */
  move(region, from, to, place) {
    const { axes } = this.movable().find((one) => one.region === region && one.place === (place ?? 0));
    const by = Vec.sub(to, from);
    axes.forEach((keys, axis) => {
      const values = keys.map((key) => this.value(key));
      // move both ends of a cylinder by exactly the same step, so that its length stays
      const along = this.flight.slots.get(keys[0])?.places[0][0] === "middle" && values[0] !== values[1];
      const step = Math.round(1024 * by[axis]) / 1024;
      if (by[axis]) keys.forEach((key, i) => this._put(key, along ? values[i] + step : Number((values[i] + by[axis]).toFixed(4))));
    });
    this.later(0);
  }

  // ---- numbers ----

  /** Return the current number of a key; undefined for one that the page cannot change. */
  value(key) {
    return this.values.get(key) ?? this.flight.slots.get(key)?.value;
  }

  set(key, value) {
    this._put(key, value);
    this.later();
  }

  /** Set the additional failure: thruster (from 1) and time [s]; null for none. */
  fail(failure) {
    this.failure = failure;
    this.later();
  }

  get changed() {
    return this.values.size > 0 || this.failure !== null;
  }

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

  // ---- flights ----

  /** Schedule a simulation after `wait` [ms]; one that runs already is completed first. */
  later(wait = LATER) {
    this.run = this.recorded.withHeader(this._header());
    this.panel.update();
    clearTimeout(this._next);
    this._next = setTimeout(() => this._fly(), wait);
  }

  async _fly() {
    if (this._flying) {
      this._again = true;
      return;
    }
    this._flying = true;
    this.panel.say("flying …");
    const [values, failure, header] = [new Map(this.values), this.failure, this._header()];
    const changed = this.changed;
    const result = await this.flight.fly(values, failure);
    this._flying = false;
    this.last = result;
    if (result.refused) this._refuse(result.refused);
    else this._show(runOfFlight(this.flight.data, result, header, changed ? [] : this.recorded.time), result, changed, failure);
    if (this._again) {
      this._again = false;
      this._fly();
    }
  }

  _refuse(text) {
    this.page.say(`These numbers cannot be flown: ${text}`, "error");
    this.panel.say("refused");
  }

  _show(run, result, changed, failure) {
    Object.assign(run.header, outcomeOf(this.flight.data, result, run, failure));
    this.took = result.took;
    this.page.say("");
    if (!changed) {
      this._compare(run);
      this._refine(run);
      this.flown = null;
      if (this.page.runs.length > 1) this.page.show([this.recorded], true);
    } else if (this.flown) {
      this.flown = run;
      this.page.replace([this._asRecorded(), run]);
    } else {
      this.flown = run;
      this.page.show([this._asRecorded(), run], true);
      this.page.select(1);
    }
    const repeats = this.repeats === 0 ? "as recorded, to the last bit" : `as recorded, within ${this.repeats?.toExponential(0)} m`;
    this.panel.say(changed ? `flown in ${decimals(result.took / 1000, 2)} s` : repeats);
  }

  _asRecorded() {
    return this.recorded.withHeader({ ...this.recorded.header, name: "as recorded" });
  }

  /** Store the largest position difference [m] to the record, for a simulation of the same numbers. */
  _compare(run) {
    const { recorded } = this;
    let row = 0;
    let most = 0;
    for (let i = 0; i < recorded.rows; i++) {
      while (row < run.rows - 1 && run.time[row] < recorded.time[i]) row++;
      if (run.time[row] !== recorded.time[i]) continue;
      for (const axis of ["x", "y", "z"]) most = Math.max(most, Math.abs(run.column(`position.${axis}`)[row] - recorded.column(`position.${axis}`)[i]));
    }
    this.repeats = most;
  }

  /** Replace the recorded run by its simulation, which has more rows, if both are equal. */
  _refine(run) {
    const { recorded } = this;
    const { step, every } = this.flight.data; // the simulation has a row for each decision, the record for each step
    const whole = recorded.end - run.end <= step * every;
    if (this.repeats !== 0 || !whole || run.rows <= recorded.rows) return;
    // signals that the simulation lacks are held from row to row of the record, as it is drawn
    const columns = recorded.header.signals.map(({ name }) => run.column(name) ?? run.time.map((t) => recorded.held(name, t)));
    this.recorded = new Run(recorded.header, columns);
    this.run = this.recorded;
    if (this.page.runs.length === 1) this.page.replace([this.recorded]);
  }

  /** Return the header of the recorded run with the current numbers. */
  _header() {
    const { header } = this.recorded;
    const { moves, restoring } = this.flight.data;
    const regions = header.regions.map((region, i) => {
      const by = (moves[i] ?? []).map((keys) => (keys.length ? this.value(keys[0]) - this.flight.slots.get(keys[0]).value : 0));
      return by.some((x) => x !== 0) ? { ...region, shape: movedShape(region.shape, by) } : region;
    });
    if (regions[0].places) regions[0] = { ...regions[0], places: goalPlaces(this.flight.data, (key) => this.value(key)) };
    const more = this.flight.slots.has(restoring.key) ? this.value(restoring.key) - this.flight.slots.get(restoring.key).value : 0;
    const truth = { ...header.truth, estimate: restoring.truth.map((phi, i) => phi + more * restoring.slopes[i]) };
    const asked = this.changed ? `With ${this.words().join(", ")}.` : header.asked;
    return { ...header, name: "what if", asked, regions, truth, changes: [], gaps: {} };
  }

  /** Return the changes as texts. */
  words() {
    const { slots } = this.flight;
    const moved = this.movable().filter(({ axes }) => axes.flat().some((key) => this.values.has(key))).map(({ name }) => `${name} moved`);
    const placed = new Set(this.movable().flatMap(({ axes }) => axes.flat()));
    const numbers = [...this.values].filter(([key]) => !placed.has(key)).map(([key, value]) => `${slots.get(key).words} ${shortNumber(value)} ${slots.get(key).unit}`.trim());
    const failed = this.failure ? [`thruster ${this.failure.thruster} failing at ${this.failure.time} s`] : [];
    return [...moved, ...numbers, ...failed];
  }
}

/** Return a shape of a header, moved by `by` [m, NED]. */
function movedShape(shape, by) {
  const add = (point) => point.map((x, axis) => x + by[axis]);
  const moved = { ...shape };
  for (const name of ["centre", "feature", "point", "start", "end"]) if (moved[name]) moved[name] = add(moved[name]);
  for (const name of ["points", "corners"]) if (moved[name]) moved[name] = moved[name].map(add);
  for (const name of ["top", "bottom", "depth"]) if (Number.isFinite(moved[name])) moved[name] += by[2];
  const { drawing } = shape;
  if (drawing) {
    moved.drawing = { ...drawing };
    if (drawing.centre) moved.drawing.centre = add(drawing.centre);
    if (drawing.points) moved.drawing.points = drawing.points.map(add);
    if (drawing.planes) moved.drawing.planes = drawing.planes.map((plane) => ({ ...plane, point: add(plane.point) }));
  }
  return moved;
}

/** Start the what-if simulation if the page has one and the browser can run it; else return null. */
async function startWhatIf(page) {
  const data = JSON.parse(document.getElementById("flight").textContent);
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
