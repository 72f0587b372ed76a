// Side panel: state of the selected run at the cursor, as text and bars.

/** Return the CSS color of a region or criterion in text: as in the header if the palette has it, else legible. */
const textColor = (color) => (hueOf(color) === color ? legible(color) : color);

/** Set the shape and color of a mark to those of a region's criterion; without a region clear them. */
function setMark(mark, run, region) {
  const index = run.header.criteria.findIndex((one) => one.name === region?.criterion);
  mark.className = `mark ${region ? (index < 0 ? "goal" : `of-${index % 4}`) : "unknown"}`;
  mark.style.background = region ? textColor(region.color) : "";
}

/** Row with a bar. */
class BarRow {
  constructor(label, color, title = "") {
    this.value = h("span.value");
    this.fill = h("span.fill", { style: `--hue: ${color}` });
    this.tick = h("span.tick", { hidden: true });
    const track = h("span.track", {}, this.fill, this.tick);
    this.element = h("li.bar-row", { title }, h("span.name", {}, label), this.value, track);
  }

  /** @param {number} part between 0 and 1  @param {string} text  @param {?number} mark another part, shown as a tick */
  update(part, text, mark = null) {
    this.fill.style.transform = `scaleX(${clamp(part || 0, 0, 1).toFixed(4)})`;
    setText(this.value, text);
    this.element.classList.toggle("on", part > 0);
    this.tick.hidden = !(mark > 0);
    this.tick.style.left = `${(100 * clamp(mark || 0, 0, 1)).toFixed(1)}%`;
  }
}

/** Panel of the selected run. */
class Panel {
  /** @param {Player} player  @param {object} on callbacks: select(index) and show(index, isShown) */
  constructor(player, on) {
    Object.assign(this, { player, on, events: [], _updated: 0 });
    this.holder = byId("panel");
  }

  setRuns(runs, shown, selected) {
    this.run = runs[selected];
    if (!this.run) return;
    const { imported, regions, criteria, rules, events = [] } = this.run.header;
    this.events = [...events]; // of a live run, the header gets more
    const hidden = { // no arbiter decided in a log
      runs: runs.length < 2, weights: imported, rules: imported, events: !events.length,
      distances: imported && regions.length === 1,
    };
    for (const [name, is] of Object.entries(hidden)) this._at(`.${name}`).hidden = is;
    const choices = runNames(runs).map((name, index) => this._choice(name, index, shown[index], index === selected));
    this._fill(".runs ul", choices);
    this.weights = criteria.map(({ name, color }, i) => new BarRow(`${name} α${i + 1}`, textColor(color)));
    this.rules = rules.map(({ words, text }) => new BarRow(words, "var(--ink)", text));
    this._fill(".weights ul", this.weights.map(({ element }) => element));
    this._fill(".rules ul", this.rules.map(({ element }) => element));
    this.distances = regions.map((region, index) => {
      const mark = h("span");
      setMark(mark, this.run, region);
      const title = regionWords(this.run, index, this.player.t);
      return h("li", {}, mark, h("span.name", { title }, region.name), h("span.value"));
    });
    this._fill(".distances ul", this.distances);
    this._fill(".numbers dl", numbersAt(this.run, this.player.t).flatMap(([name]) => [h("dt", {}, name), h("dd")]));
    this._at(".events .note").textContent = events.length;
    this._fill(".events ol", events.map(({ time, kind, text }) => {
      const mark = h(`span.mark-at.${kind}`, { ariaHidden: true });
      const onclick = () => this.player.seek(time);
      return h("li", {}, h("button.event", { onclick }, mark, h("span.at", {}, clock(time)), h("span.text", {}, text)));
    }));
    this.update(true);
  }

  /** Show the values at the cursor, at most 11 times a second while it plays. */
  update(atOnce = false) {
    const now = performance.now();
    if (!this.run || (!atOnce && this.player.playing && now - this._updated < 90)) return;
    this._updated = now;
    const { run, player: { t, duration } } = this;
    const active = activeWords(run, t);
    setMark(this._at(".who .mark"), run, active.region);
    setText(this._at(".who strong"), active.name);
    setText(this._at(".what"), active.region ? regionWords(run, active.index, t) : "");
    setText(this._at(".why"), active.sentence);
    const over = t > run.end && duration > 0;
    setText(this._at(".over"), over ? `This run ended at ${clock(run.end)}; it stays as it was then.` : "");
    run.header.criteria.forEach(({ name }, i) => {
      const [weight, asks] = ["weight", "membership"].map((kind) => run.held(`${kind}.${name}`, t));
      this.weights[i].update(weight, `${figure(weight, 2)} (asks ${figure(asks, 2)})`, asks);
    });
    const strengths = run.header.rules.map(({ label }) => run.held(`rule.${label}`, t));
    strengths.forEach((strength, i) => this.rules[i].update(strength, figure(strength, 2)));
    const fired = strengths.filter((strength) => strength > 0).length;
    setText(this._at(".rules .note"), `${fired} of ${strengths.length} fire`);
    this._sort(distancesAt(run, t), active.index);
    numbersAt(run, t).forEach(([, text], i) => {
      const [name, value] = [...this._at(".numbers dl").children].slice(2 * i, 2 * i + 2);
      setText(value, text);
      name.hidden = value.hidden = !text;
    });
    this.events.forEach(({ time }, i) => this._at(".events ol").children[i].classList.toggle("passed", time <= t));
  }

  _at(selector) { return this.holder.querySelector(selector); }

  _fill(selector, items) { this._at(selector).replaceChildren(...items); }

  _choice(name, index, shown, selected) {
    const box = checkbox(shown, `Show ${name}`, () => this.on.show(index, box.checked));
    const props = { title: `Show ${name} in this panel`, ariaPressed: selected, onclick: () => this.on.select(index) };
    const choose = h("button.choose", props, swatch(runColor(index), runDash(index)), name);
    return h("li", { className: selected ? "selected" : "" }, box, choose);
  }

  _sort(rows, active) {
    rows.forEach(({ index, region, clearance }, place) => {
      const item = this.distances[index];
      item.hidden = !this.run.there(index, this.player.t); // a temporary obstacle
      const against = clearance < 0 && region.criterion;
      item.className = `${against ? "violated" : ""} ${index === active ? "active" : ""}`;
      const mark = against ? "✕ " : clearance >= 0 && !region.criterion ? "✓ " : "";
      setText(item.lastChild, mark + clearanceWords(clearance, region));
      const list = item.parentElement;
      if (list.children[place] !== item) list.insertBefore(item, list.children[place]);
    });
  }
}
