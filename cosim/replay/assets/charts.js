// Strip chart: a legend with the values at the cursor, and a plot that seeks.

/** Return a fixed range of values with room for the lines at its ends. */
function widened([least, most]) {
  return [least - 0.03 * (most - least), most + 0.06 * (most - least)];
}

/** Return a new element with a class and a text. */
function element(tag, className = "", text = "") {
  const made = document.createElement(tag);
  if (className) made.className = className;
  if (text) made.textContent = text;
  return made;
}

/** Return a new button that calls `does` when it is pressed. */
function pressable(className, text, title, does) {
  const button = element("button", className, text);
  Object.assign(button, { type: "button", title });
  button.addEventListener("click", does);
  return button;
}

/** Return a label with a number field in it, for screen readers named `said`: [label, field]. */
function numberField(text, said, step) {
  const label = element("label", "", text);
  const field = element("input");
  Object.assign(field, { type: "number", step: String(step) });
  field.setAttribute("aria-label", said);
  label.append(field);
  return [label, field];
}

/** Return a short SVG line in the color and dash of a curve; SVG also prints. */
function swatch(colour, dash) {
  const space = "http://www.w3.org/2000/svg";
  const svg = document.createElementNS(space, "svg");
  const line = document.createElementNS(space, "line");
  for (const [name, value] of Object.entries({ width: 22, height: 8, viewBox: "0 0 22 8", "aria-hidden": "true" })) {
    svg.setAttribute(name, value);
  }
  for (const [name, value] of Object.entries({ x1: 0, x2: 22, y1: 4, y2: 4, "stroke-width": 2.5 })) line.setAttribute(name, value);
  line.setAttribute("stroke", colour);
  line.setAttribute("stroke-dasharray", dash.join(" "));
  svg.append(line);
  svg.setAttribute("class", "swatch");
  return svg;
}

/**
 * Strip chart of one kind of signals, for all shown runs.
 *
 * `element` goes into the page. `on` has the callbacks of the board: seek(t), hover(t, chart, y) or hover(null),
 * zoom(factor, t), pan(seconds), window(from, to), whole(), changed().
 */
class Chart {
  constructor(spec, theme, on) {
    this.spec = spec;
    this.theme = theme;
    this.on = on;
    this.near = true; // true if it is on the screen or close to it
    this.stale = true;
    this.window = [0, 1];
    this.curves = [];
    this.frame = null;
    this._off = new Set(); // names of signals that the reader has hidden
    this._build();
  }

  /** @param {{run: Run, index: number, name: string}[]} shown  @param {boolean} several true if the page has several runs */
  setRuns(shown, several) {
    this._shown = shown;
    this._several = several;
    this._collect();
    this._legend();
  }

  /** Return the drawn curves: index of the run in the page, signal, label, times [s] and values. */
  series() {
    return this.curves.map(({ index, run, signal: of, values }) => ({
      run: index, name: of.name, label: of.label, time: run.time, values,
    }));
  }

  setTheme(theme) {
    this.theme = theme;
    this.stale = true;
    if (this._shown) this._legend();
  }

  /** Show a time window [s]; `rest` is the start of the final rest [s], or null for a time axis without break. */
  setWindow(from, to, rest = null) {
    this.window = [from, to];
    this.rest = rest;
    this.stale = true;
  }

  /** Collect the curves again after rows were appended. */
  grown() {
    this._collect();
  }

  /** Paint the canvas if it is stale; with `cursor` [s], paint a cursor there too. */
  paint(cursor = null) {
    if (!this.stale || this.element.hidden) return;
    const { clientWidth: width, clientHeight: height } = this.plot;
    if (width < 80 || height < 40) return;
    const dots = window.devicePixelRatio || 1;
    if (this.canvas.width !== Math.round(width * dots)) this.canvas.width = Math.round(width * dots);
    if (this.canvas.height !== Math.round(height * dots)) this.canvas.height = Math.round(height * dots);
    const context = this.canvas.getContext("2d");
    context.setTransform(dots, 0, 0, dots, 0, 0);
    const { fixed, zero, down } = this.spec;
    const range = fixed ? widened(fixed) : rangeOf(this.curves, this.window, zero);
    this.frame = new Frame(width, height, this.window, this.rest, range, down);
    paintPlot(context, this.frame, this.spec, this.curves, this.theme);
    context.fillStyle = hueColour("ink", this.theme);
    if (cursor !== null) context.fillRect(this.frame.x(cursor) - 0.75, this.frame.top, 1.5, this.frame.bottom - this.frame.top);
    this.stale = false;
  }

  /** Move the cursor to a time [s]. */
  point(t) {
    this._place(this.cursor, t);
  }

  /** Write the values of one run at a time [s] into the legend. */
  update(t, index) {
    for (const { of, value } of this._entries) {
      const curve = this.curves.find((one) => one.signal === of && one.index === index);
      const text = curve ? reading(valueAt(curve, t), this.spec.unit) : "";
      if (value.textContent !== text) value.textContent = text;
    }
  }

  /** Show a line at the pointer's time [s]; with `y` [pixels], also a tip that names the nearest curve. */
  hover(t, y = null) {
    this._place(this.ghost, t);
    this.tip.hidden = t === null || y === null || !this.frame?.range;
    if (this.tip.hidden) return;
    const nearest = this._nearest(t, y);
    this.tip.textContent = `${clock(t)}${nearest ? ` · ${nearest}` : ""}`;
    const x = this.frame.x(t);
    const right = x > this.frame.width / 2;
    this.tip.style.transform = `translate(${x + (right ? -8 : 8)}px, 0) translateX(${right ? "-100%" : "0"})`;
  }

  _place(line, t) {
    const shown = t !== null && this.frame && t >= this.window[0] - 1e-9 && t <= this.window[1] + 1e-9;
    line.style.visibility = shown ? "visible" : "hidden";
    if (shown) line.style.transform = `translateX(${this.frame.x(t).toFixed(1)}px)`;
  }

  _nearest(t, y) {
    let best = { gap: 26, text: "" };
    for (const curve of this.curves) {
      const { index, signal: of } = curve;
      const value = valueAt(curve, t);
      const gap = Math.abs(this.frame.y(value) - y) + (of.faint ? 4 : 0);
      if (!(gap < best.gap)) continue;
      const whose = this._several ? `${this._names[index]}: ` : "";
      best = { gap, text: `${whose}${of.label} ${quantity(value, this.spec.unit)}` };
    }
    return best.text;
  }

  _collect() {
    this.curves = this._shown.flatMap(({ run, index }) =>
      this.spec.signals
        .filter((of) => !this._off.has(of.name))
        .map((of) => ({ index, run, signal: of, values: of.values(run), dash: this._several && !of.context ? runDash(index) : of.dash }))
        .filter(({ values }) => values),
    );
    this._names = Object.fromEntries(this._shown.map(({ index, name }) => [index, name]));
    this.stale = true;
  }

  _legend() {
    const faint = this.spec.signals.filter((of) => of.faint);
    this._entries = [];
    const items = this.spec.signals.filter((of) => !of.faint).map((of) => {
      const button = pressable("key", "", `Put ${of.label} in or out`, () => {
        if (!this._off.delete(of.name)) this._off.add(of.name);
        button.setAttribute("aria-pressed", String(!this._off.has(of.name)));
        this._collect();
        this.on.changed();
      });
      button.setAttribute("aria-pressed", String(!this._off.has(of.name)));
      const value = element("span", "value");
      button.append(swatch(hueColour(of.hue, this.theme, of.shade), this._several && !of.context ? [] : of.dash), of.label, value);
      this._entries.push({ of, value });
      return button;
    });
    if (faint.length) {
      const rest = element("span", "key");
      rest.append(swatch(hueColour("grey", this.theme), []), `${faint.length} farther regions`);
      items.push(rest);
    }
    this.legend.replaceChildren(...items);
  }

  _build() {
    this.element = element("figure", "chart");
    const caption = element("figcaption");
    const unit = this.spec.unit === "rad" ? "°" : this.spec.unit.replace(".", "\u00b7");
    const title = element("h3", "", this.spec.title);
    if (unit) title.append(element("span", "unit", ` [${unit}]`));
    this.legend = element("div", "legend");
    caption.append(title, this.legend);
    this.plot = element("div", "plot");
    this.canvas = element("canvas");
    this.canvas.setAttribute("role", "img");
    const names = this.spec.signals.map((of) => of.label);
    const listed = names.slice(0, 8).join(", ") + (names.length > 8 ? ` and ${names.length - 8} more` : "");
    this.canvas.setAttribute("aria-label", `${this.spec.title} against time: ${listed}. Values at the cursor stand above.`);
    this.ghost = element("div", "ghost");
    this.cursor = element("div", "cursor");
    this.brush = element("div", "brush");
    this.tip = element("div", "tip");
    this.tip.hidden = this.brush.hidden = true;
    this.plot.append(this.canvas, this.brush, this.ghost, this.cursor, this.tip);
    this.element.append(caption, this.plot);
    handlePlot(this);
  }
}

/** Return the value of a curve at a time [s]; a growing run may have rows that the curve lacks. */
function valueAt({ run, values }, t) {
  return values.length ? values[Math.min(run.row(t), values.length - 1)] : NaN;
}

/** Listen to the pointer: drag seeks, Shift+drag selects a window, Ctrl or Shift+wheel zooms, double click resets. */
function handlePlot(chart) {
  const { plot, on } = chart;
  let from = null; // {x, y, mode} of a press
  const place = (event) => {
    const box = plot.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  };
  const done = () => {
    from = null;
    chart.brush.hidden = true;
  };
  plot.addEventListener("pointerdown", (event) => {
    if (event.button !== 0 || !chart.frame) return;
    const { x, y } = place(event);
    // a finger may be about to scroll the page
    from = { x, y, mode: event.pointerType === "touch" ? "perhaps" : event.shiftKey ? "window" : "seek" };
    plot.setPointerCapture(event.pointerId);
    if (from.mode === "seek") on.seek(chart.frame.time(x));
  });
  plot.addEventListener("pointermove", (event) => {
    if (!chart.frame) return;
    const { x, y } = place(event);
    if (!from) {
      if (event.pointerType !== "touch") on.hover(chart.frame.time(x), chart, y);
      return;
    }
    if (from.mode === "perhaps" && Math.abs(x - from.x) > 8) from.mode = "seek";
    if (from.mode === "seek") on.seek(chart.frame.time(x));
    if (from.mode === "window") {
      const [left, right] = [Math.min(x, from.x), Math.max(x, from.x)];
      chart.brush.hidden = false;
      chart.brush.style.left = `${left}px`;
      chart.brush.style.width = `${right - left}px`;
    }
  });
  plot.addEventListener("pointerup", (event) => {
    if (!from) return;
    const { x } = place(event);
    if (from.mode === "perhaps") on.seek(chart.frame.time(x));
    if (from.mode === "window" && Math.abs(x - from.x) > 4) {
      on.window(chart.frame.time(Math.min(x, from.x)), chart.frame.time(Math.max(x, from.x)));
    }
    done();
  });
  plot.addEventListener("pointercancel", done);
  plot.addEventListener("pointerleave", () => on.hover(null));
  plot.addEventListener("dblclick", () => on.whole());
  plot.addEventListener(
    "wheel",
    (event) => {
      if (!chart.frame) return;
      const turn = event.deltaY || event.deltaX;
      if (event.ctrlKey || event.shiftKey || event.metaKey) {
        event.preventDefault();
        on.zoom(Math.exp(Math.sign(turn) * Math.min(0.4, Math.abs(turn) / 300)), chart.frame.time(place(event).x));
      } else if (Math.abs(event.deltaX) > Math.abs(event.deltaY)) {
        event.preventDefault();
        on.pan((event.deltaX / (chart.frame.right - chart.frame.left)) * (chart.window[1] - chart.window[0]));
      }
    },
    { passive: false },
  );
}
