// Fields over the scene for the numbers that a reader may change, also by keyboard or without a position.

const WHAT_IF_HINT =
  "Drag the goal or a region in the scene (Shift: up and down), or change a number: the run is flown again.";

/** Panel of the fields and buttons of a `WhatIf`. */
class WhatIfPanel extends FieldPanel {
  /** @param {WhatIf} whatIf */
  constructor(whatIf) {
    super(whatIf.page, "What if");
    this.whatIf = whatIf;
    this.slots = whatIf.flight.slots;
    this._fields = []; // each with a function that returns its current text
    const reset = { title: "Back to the run as it was recorded (R)", onclick: () => whatIf.reset() };
    const save = { title: "A file that “cosim run” repeats (S)", onclick: () => saveScenario(whatIf) };
    this.resetting = h("button", reset, "Reset");
    const buttons = h("div.command-buttons.of-two", {}, this.resetting, h("button", save, "Save scenario"));
    const water = h("div.command-list", {}, ...this._water());
    const sets = [water, ...this._noise(), ...this._thruster(), ...this._gain(), this._places()];
    this.body.append(buttons, h("p.hint", {}, WHAT_IF_HINT), ...sets);
    this.update();
  }

  say(text) { setText(this.state, text); }

  /** Write the current numbers into all fields except an input field with the focus. */
  update() {
    for (const { field, now } of this._fields) {
      const text = now();
      if (field !== document.activeElement || field.tagName === "SELECT") field.value = text;
    }
    this.resetting.disabled = !this.whatIf.changed;
  }

  /** Return the label of a number field; `now` returns its number, `changed` gets a new one. */
  _number(text, ariaLabel, step, now, changed, props = {}) {
    const oninput = () => {
      if (Number.isFinite(field.valueAsNumber)) changed(field.valueAsNumber);
    };
    const [label, field] = numberField(text, ariaLabel, step, { oninput, onblur: () => this.update(), ...props });
    this._fields.push({ field, now: () => shortNumber(now()) });
    return label;
  }

  _ofKey(text, ariaLabel, step, key, props) {
    const { whatIf } = this;
    return this._number(text, ariaLabel, step, () => whatIf.value(key), (value) => whatIf.set(key, value), props);
  }

  /** Return a selection of [value, text] options. */
  _choice(ariaLabel, options, now, onchange) {
    const choice = h("select", { ariaLabel, onchange }, ...options.map(([value, text]) => new Option(text, value)));
    this._fields.push({ field: choice, now });
    return choice;
  }

  _pair(title, ...fields) {
    const set = fieldSet(title, ...fields);
    set.classList.add("of-two");
    return set;
  }

  _water() {
    const { whatIf } = this;
    const current = DIRECTIONS.map(([letter, direction], axis) =>
      this._ofKey(letter, `current ${direction} in meters a second`, 0.05, `plant.current.${axis}`));
    const { key, weight } = whatIf.flight.data.restoring;
    const sets = [fieldSet("Current, m/s", ...current)];
    if (!this.slots.has(key)) return sets;
    const now = () => weight - whatIf.value(key);
    const changed = (value) => whatIf.set(key, Number((weight - value).toFixed(4)));
    const field = this._number("W−B", "weight less buoyancy in newtons", 0.5, now, changed);
    return [...sets, this._pair("Weight less buoyancy, N", field)];
  }

  _noise() {
    const keys = [["m", "sensing.position_noise"], ["m/s", "sensing.velocity_noise"]];
    if (!keys.every(([, key]) => this.slots.has(key))) return [];
    const fields = keys.map(([unit, key]) => this._ofKey(unit, this.slots.get(key).words, 0.005, key, { min: 0 }));
    return [this._pair("Noise of what is measured", ...fields)];
  }

  _thruster() {
    const { whatIf } = this;
    const { failures } = whatIf.flight.data;
    if (!failures) return [];
    let time = Number((0.25 * whatIf.recorded.end).toFixed(1));
    const apply = () => whatIf.fail(choice.value === "0" ? null : { thruster: Number(choice.value), time });
    const options = Array.from({ length: failures.thrusters }, (_, i) => [i + 1, `thruster ${i + 1}`]);
    const now = () => whatIf.failure?.thruster ?? 0;
    const choice = this._choice("thruster that fails", [[0, "none"], ...options], now, apply);
    const changed = (value) => {
      time = clamp(value, 0, whatIf.recorded.header.duration);
      if (whatIf.failure) apply();
    };
    const field = this._number("at s", "time at which it fails, in seconds", 0.5, () => time, changed, { min: 0 });
    return [this._pair("Thruster that fails", choice, field)];
  }

  _gain() {
    const { whatIf } = this;
    const keys = [...this.slots.keys()].filter((key) => key.startsWith("law.gains."));
    if (!keys.length) return [];
    const name = (key) => (whatIf.values.has(key) ? "• " : "") + key.slice(10).replaceAll("_", " ");
    const choice = this._choice("gain", keys.map((key) => [key, ""]), () => {
      for (const option of choice.options) setText(option, name(option.value));
      return choice.value;
    }, () => this.update());
    const now = () => whatIf.value(choice.value);
    const changed = (value) => whatIf.set(choice.value, value);
    return [this._pair("Gain of the law", choice, this._number("", "value of the gain", "any", now, changed))];
  }

  _places() {
    const { whatIf } = this;
    const { regions } = whatIf.recorded.header;
    const sets = whatIf.groups().map(({ region, place, name, axes }) => {
      const values = () => axes.map(([key]) => whatIf.value(key));
      const handle = () => placeOf(whatIf.run, region, whatIf.run.start, place) ?? values();
      const fields = [...axes.keys()].filter((axis) => axes[axis].length).map((axis) => {
        const [letter, direction] = DIRECTIONS[axis];
        const changed = (value) => whatIf.move(region, handle(), handle().with(axis, value), place);
        return this._number(letter, `${name}, ${direction} in meters`, 0.1, () => handle()[axis], changed);
      });
      return fieldSet(name, ...fields);
    });
    const fixed = regions.filter((_, region) => !whatIf.canMove(region));
    if (fixed.length) sets.push(h("p.hint", {}, wordsOfFixed(fixed)));
    return h("div.command-list", {}, h("p.hint", {}, "Places in meters:"), ...sets);
  }
}

/** Return a text that explains why some regions cannot be moved here. */
function wordsOfFixed(regions) {
  const isTurned = ({ shape }) => Boolean(shape.sight) && !shape.sight.feature;
  const [turned, placed] = [true, false].map((is) =>
    regions.filter((region) => isTurned(region) === is).map(({ name }) => name).join(", "));
  return [
    turned && `Attitude alone, without a place: ${turned}.`,
    placed && `Not moved in this page, as the law is given other numbers than the scenario: ${placed}.`,
    "Change these in the saved scenario.",
  ].filter(Boolean).join(" ");
}
