// Fields over the scene for the numbers that a reader may change, also by keyboard or without a position.

/** Panel of the fields and buttons of a `WhatIf`. */
class WhatIfPanel {
  /** @param {WhatIf} whatIf */
  constructor(whatIf) {
    this.whatIf = whatIf;
    this.slots = whatIf.flight.slots;
    this._fields = []; // each with a function that returns its current text
    this.holder = element("details", "commands");
    this.holder.id = "commands";
    this.holder.open = matchMedia("(min-width: 960px)").matches;
    this.state = element("span", "note");
    const summary = element("summary", "", "What if ");
    summary.append(this.state);
    this.body = element("div", "command-body");
    const hint = "Drag the goal or a region in the scene (Shift: up and down), or change a number: the run is flown again.";
    this.body.append(this._buttons(), element("p", "hint", hint), this._water(), this._noise(), this._thruster(), this._gain(), this._places());
    this.holder.append(summary, this.body);
    document.getElementById("stage").append(this.holder);
    whatIf.page.stage.coveredBy(this.holder);
    this.update();
  }

  say(text) {
    setText(this.state, text);
  }

  /** Write the current numbers into all fields except an input field with the focus. */
  update() {
    for (const { field, now } of this._fields) {
      if (field === document.activeElement && field.tagName === "INPUT") continue;
      const text = now();
      if (field.value !== text) field.value = text;
    }
    this.resetting.disabled = !this.whatIf.changed;
  }

  _buttons() {
    const group = element("div", "command-buttons of-two");
    this.resetting = pressable("", "Reset", "Back to the run as it was recorded (R)", () => this.whatIf.reset());
    group.append(this.resetting, pressable("", "Save scenario", "A file that “cosim run” repeats (S)", () => saveScenario(this.whatIf)));
    return group;
  }

  /** Add a number field to a set of fields and return it. */
  _number(set, label, said, step, now, changed) {
    const [holder, field] = numberField(label, said, step);
    field.addEventListener("input", () => {
      if (Number.isFinite(field.valueAsNumber)) changed(field.valueAsNumber);
    });
    field.addEventListener("blur", () => this.update());
    set.append(holder);
    this._fields.push({ field, now });
    return field;
  }

  _ofKey(set, label, said, step, key) {
    const least = key.startsWith("plant.current") || key.includes("centre") ? null : 0;
    const field = this._number(set, label, said, step, () => shortNumber(this.whatIf.value(key)), (value) => this.whatIf.set(key, value));
    if (least !== null) field.min = String(least);
  }

  _set(title) {
    const set = element("fieldset");
    set.append(element("legend", "", title));
    return set;
  }

  _water() {
    const both = element("div", "command-list");
    const current = this._set("Current, m/s");
    ["N", "E", "D"].forEach((letter, axis) => this._ofKey(current, letter, `current ${["north", "east", "down"][axis]} in metres a second`, 0.05, `plant.current.${axis}`));
    both.append(current);
    const { key, weight } = this.whatIf.flight.data.restoring;
    if (!this.slots.has(key)) return both;
    const set = this._set("Weight less buoyancy, N");
    set.classList.add("of-two");
    const now = () => shortNumber(weight - this.whatIf.value(key));
    this._number(set, "W−B", "weight less buoyancy in newtons", 0.5, now, (value) => this.whatIf.set(key, Number((weight - value).toFixed(4))));
    both.append(set);
    return both;
  }

  _noise() {
    const set = this._set("Noise of what is measured");
    const keys = ["sensing.position_noise", "sensing.velocity_noise"];
    set.hidden = !keys.every((key) => this.slots.has(key));
    set.classList.add("of-two");
    if (!set.hidden) keys.forEach((key, i) => this._ofKey(set, ["m", "m/s"][i], this.slots.get(key).words, [0.005, 0.005][i], key));
    return set;
  }

  _thruster() {
    const { whatIf } = this;
    const set = this._set("Thruster that fails");
    const { failures } = whatIf.flight.data;
    set.hidden = !failures;
    if (!failures) return set;
    set.classList.add("of-two");
    let time = Number((0.25 * whatIf.recorded.end).toFixed(1));
    const choice = element("select");
    choice.setAttribute("aria-label", "thruster that fails");
    choice.append(new Option("none", "0"), ...failures.limits[0].map((_, i) => new Option(`thruster ${i + 1}`, String(i + 1))));
    const apply = () => whatIf.fail(choice.value === "0" ? null : { thruster: Number(choice.value), time });
    choice.addEventListener("change", apply);
    set.append(choice);
    this._fields.push({ field: choice, now: () => String(whatIf.failure?.thruster ?? 0) });
    this._number(set, "at s", "time at which it fails, in seconds", 0.5, () => String(time), (value) => {
      time = Math.min(Math.max(0, value), whatIf.recorded.header.duration);
      if (whatIf.failure) apply();
    }).min = "0";
    return set;
  }

  _gain() {
    const { whatIf } = this;
    const set = this._set("Gain of the law");
    const keys = [...this.slots.keys()].filter((key) => key.startsWith("law.gains."));
    set.hidden = !keys.length;
    if (!keys.length) return set;
    set.classList.add("of-two");
    const choice = element("select");
    choice.setAttribute("aria-label", "gain");
    const options = keys.map((key) => new Option("", key));
    choice.append(...options);
    choice.addEventListener("change", () => this.update());
    set.append(choice);
    const names = () => options.forEach((option, i) => setText(option, `${whatIf.values.has(keys[i]) ? "• " : ""}${keys[i].slice(10).replaceAll("_", " ")}`));
    const now = () => {
      names();
      return shortNumber(whatIf.value(choice.value));
    };
    this._number(set, "", "value of the gain", "any", now, (value) => whatIf.set(choice.value, value));
    return set;
  }

  _places() {
    const { whatIf } = this;
    const list = element("div", "command-list");
    list.append(element("p", "hint", "Places in metres:"));
    const { regions } = whatIf.recorded.header;
    for (const { region, place, name, axes } of whatIf.movable()) {
      const set = this._set(name);
      axes.forEach((keys, axis) => {
        if (!keys.length) return;
        const now = () => placeOf(whatIf.run, region, whatIf.run.start, place)?.[axis] ?? whatIf.value(keys[0]);
        const said = `${name}, ${["north", "east", "down"][axis]} in metres`;
        this._number(set, ["N", "E", "D"][axis], said, 0.1, () => shortNumber(now()), (value) => {
          const from = [0, 0, 0].map((_, i) => (i === axis ? now() : 0));
          whatIf.move(region, from, from.map((x, i) => (i === axis ? value : x)), place);
        });
      });
      list.append(set);
    }
    const fixed = regions.filter((_, region) => !whatIf.canMove(region));
    if (fixed.length) list.append(element("p", "hint", wordsOfFixed(fixed)));
    return list;
  }
}

/** Return a text that explains why some regions cannot be moved here. */
function wordsOfFixed(regions) {
  const named = (those) => those.map(({ name }) => name).join(", ");
  const isTurned = ({ shape }) => shape.kind in SIGHTS && !shape.feature;
  const [turned, placed] = [regions.filter(isTurned), regions.filter((region) => !isTurned(region))];
  return [
    turned.length ? `Attitude alone, without a place: ${named(turned)}.` : "",
    placed.length ? `Not moved in this page, as the law is given other numbers than the scenario: ${named(placed)}.` : "",
    "Change these in the saved scenario.",
  ].filter(Boolean).join(" ");
}

/** Format a number with at most four decimals for an input field, which is empty without one. */
function shortNumber(x) {
  return Number.isFinite(x) ? String(Number(x.toFixed(4))) : "";
}
