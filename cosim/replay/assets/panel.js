// Side panel: state of the selected run at the cursor, as text and bars.

/** Return the CSS color of a hue: a variable of the page, or "#rrggbb" as it is legible in the page's theme. */
function cssHue(hue) {
  return hue.startsWith("#") ? legible(hue, document.documentElement.dataset.theme) : `var(--${hue})`;
}

/** Set the shape and color of a mark to those of a region's criterion; without a region clear them. */
function setMark(mark, run, region) {
  const place = run.header.criteria.findIndex((one) => one.name === region?.criterion);
  mark.className = `mark ${region ? (place < 0 ? "goal" : `of-${place % 4}`) : "unknown"}`;
  mark.style.background = region ? cssHue(hueOf(region.colour)) : "";
}

/** Row with a bar; it is built once and then updated. */
class BarRow {
  constructor(label, hue) {
    this.element = element("li", "bar-row");
    this.name = element("span", "name", label);
    this.value = element("span", "value");
    this.fill = element("span", "fill");
    if (hue) this.fill.style.setProperty("--hue", cssHue(hue));
    const track = element("span", "track");
    this.tick = element("span", "tick");
    this.tick.hidden = true;
    track.append(this.fill, this.tick);
    this.element.append(this.name, this.value, track);
  }

  /** @param {number} part between 0 and 1  @param {string} text  @param {?number} mark another part, shown as a tick */
  update(part, text, mark = null) {
    const whole = Number.isFinite(part) ? Math.min(1, Math.max(0, part)) : 0;
    this.fill.style.transform = `scaleX(${whole.toFixed(4)})`;
    if (this.value.textContent !== text) this.value.textContent = text;
    this.element.classList.toggle("on", part > 0);
    this.tick.hidden = !(mark > 0);
    if (!this.tick.hidden) this.tick.style.left = `${(100 * Math.min(1, Math.max(0, mark))).toFixed(1)}%`;
  }
}

/** Panel of the selected run. */
class Panel {
  /** @param {Player} player  @param {object} on callbacks: select(index) and show(index, isShown) */
  constructor(player, on) {
    this.player = player;
    this.on = on;
    this.holder = document.getElementById("panel");
    this._updated = 0;
  }

  setRuns(runs, shown, selected) {
    this.runs = runs;
    this.run = runs[selected];
    this.holder.replaceChildren();
    if (runs.length > 1) this._runs(shown, selected);
    if (!this.run) return;
    this._now();
    this._weights();
    this._distances();
    this._rules();
    this._numbers();
    this._events();
    this.update(true);
  }

  /** Show the values at the cursor, at most 11 times a second while it plays. */
  update(atOnce = false) {
    const now = performance.now();
    if (!this.run || (!atOnce && this.player.playing && now - this._updated < 90)) return;
    this._updated = now;
    const { run } = this;
    const t = this.player.t;
    const active = activeWords(run, t);
    setMark(this.mark, this.run, active.region);
    setText(this.who, active.name);
    setText(this.what, active.region ? regionWords(run, active.index, t) : "");
    setText(this.why, active.sentence);
    const over = t > run.end && this.player.duration > 0;
    this.over.hidden = !over;
    if (over) setText(this.over, `This run ended at ${clock(run.end)}; it stays as it was then.`);
    for (const [name, row] of this.weights) {
      const [weight, asks] = ["weight", "membership"].map((kind) => run.held(`${kind}.${name}`, t));
      row.update(weight, `${figure(weight, 2)} (asks ${figure(asks, 2)})`, asks);
    }
    const rules = firedRules(run, t);
    rules.forEach(({ strength }, i) => this.rules[i].update(strength, figure(strength, 2)));
    setText(this.ruled, `${rules.filter(({ strength }) => strength > 0).length} of ${rules.length} fire`);
    this._sort(distancesAt(run, t), active.index);
    numbersAt(run, t).forEach(([, text], i) => {
      setText(this.numbers[i], text);
      this.numbers[i].hidden = this.numbers[i].previousSibling.hidden = !text;
    });
    this._passed(t);
  }

  _section(title, className) {
    const section = element("section", className);
    const heading = element("h2", "", title);
    section.append(heading);
    this.holder.append(section);
    return { section, heading };
  }

  _runs(shown, selected) {
    const { section } = this._section("Runs", "runs");
    const list = element("ul");
    runNames(this.runs).forEach((name, index) => {
      const item = element("li", index === selected ? "selected" : "");
      const box = element("input");
      box.type = "checkbox";
      box.checked = shown[index];
      box.setAttribute("aria-label", `Show ${name}`);
      box.addEventListener("change", () => this.on.show(index, box.checked));
      const choose = pressable("choose", "", `Show ${name} in this panel`, () => this.on.select(index));
      choose.setAttribute("aria-pressed", String(index === selected));
      choose.append(swatch(runColour(index), runDash(index)), name);
      item.append(box, choose);
      list.append(item);
    });
    section.append(list);
  }

  _now() {
    const { section } = this._section("What matters now", "now");
    const line = element("p", "who");
    this.mark = element("span", "mark goal");
    this.mark.setAttribute("aria-hidden", "true");
    this.who = element("strong");
    this.what = element("span", "what");
    this.why = element("p", "why");
    this.over = element("p", "over");
    line.append(this.mark, this.who, this.what);
    section.append(line, this.why, this.over);
  }

  _weights() {
    const { section, heading } = this._section("Weights", "weights");
    section.hidden = Boolean(this.run.header.imported); // no arbiter decided in a log
    heading.append(element("span", "note", "bar: weight, tick: attention asked"));
    this.weights = this.run.header.criteria.map(({ name, colour }, i) => {
      return [name, new BarRow(`${name} α${i + 1}`, hueOf(colour))];
    });
    section.append(listOf(this.weights.map(([, row]) => row.element)));
  }

  _rules() {
    const { section, heading } = this._section("Rules", "rules");
    section.hidden = Boolean(this.run.header.imported);
    this.ruled = element("span", "note");
    heading.append(this.ruled);
    this.rules = this.run.header.rules.map((rule) => {
      const row = new BarRow(rule.words, "ink");
      row.element.title = rule.text;
      return row;
    });
    section.append(listOf(this.rules.map((row) => row.element)));
  }

  _distances() {
    const { section, heading } = this._section("Distances", "distances");
    section.hidden = this.run.header.imported && this.run.header.regions.length === 1;
    heading.append(element("span", "note", "most critical first"));
    this.distances = this.run.header.regions.map((region, index) => {
      const item = element("li");
      const mark = element("span");
      setMark(mark, this.run, region);
      const name = element("span", "name", region.name);
      const value = element("span", "value");
      name.title = regionWords(this.run, index, this.player.t);
      item.append(mark, name, value);
      return { item, value, name };
    });
    this.order = listOf(this.distances.map(({ item }) => item));
    section.append(this.order);
  }

  _sort(rows, active) {
    rows.forEach(({ index, region, clearance }, place) => {
      const { item, value } = this.distances[index];
      item.hidden = !this.run.there(index, this.player.t); // a temporary obstacle
      const against = clearance < 0 && region.criterion;
      item.className = `${against ? "violated" : ""} ${index === active ? "active" : ""}`;
      const mark = against ? "✕ " : clearance >= 0 && !region.criterion ? "✓ " : "";
      setText(value, mark + clearanceWords(clearance, region));
      if (this.order.children[place] !== item) this.order.insertBefore(item, this.order.children[place] ?? null);
    });
  }

  _numbers() {
    const { section } = this._section("Vehicle", "numbers");
    const list = element("dl");
    this.numbers = numbersAt(this.run, this.player.t).map(([name]) => {
      const value = element("dd");
      list.append(element("dt", "", name), value);
      return value;
    });
    section.append(list);
  }

  _events() {
    this.events = [];
    const { events } = this.run.header;
    if (!events?.length) return;
    const { section, heading } = this._section("Events", "events");
    heading.append(element("span", "note", String(events.length)));
    const list = element("ol");
    for (const { time, kind, text } of events) {
      const item = element("li");
      const button = pressable(`event ${kind}`, "", "", () => this.player.seek(time));
      const mark = element("span", `mark-at ${kind}`);
      mark.setAttribute("aria-hidden", "true");
      button.append(mark, element("span", "at", clock(time)), element("span", "text", text));
      item.append(button);
      list.append(item);
      this.events.push({ time, item });
    }
    section.append(list);
  }

  _passed(t) {
    for (const { time, item } of this.events) item.classList.toggle("passed", time <= t);
  }
}

/** Set a text only if it differs, so that screen readers and layout see no other change. */
function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

/** Return a list of items. */
function listOf(items) {
  const list = element("ul");
  list.append(...items);
  return list;
}
