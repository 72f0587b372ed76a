// Strip chart: a legend with the values at the cursor, and a plot that seeks.

/** Return a fixed range of values with room for the lines at its ends. */
const widened = ([least, most]) => [least - 0.03 * (most - least), most + 0.06 * (most - least)];

/**
 * Strip chart of one kind of signals, for all shown runs.
 *
 * `element` goes into the page. `on` has the callbacks of the board: seek(t), hover(t, chart, y) or hover(null),
 * zoom(factor, t), pan(seconds), window(from, to), whole(), changed().
 */
class Chart {
  constructor(spec, on) {
    Object.assign(this, { spec, on, frame: null, window: [0, 1], curves: [] });
    this.near = true; // true if it is on the screen or close to it
    this.stale = true;
    this._off = new Set(); // names of signals that the reader has hidden
    const { title, signals } = spec;
    const unit = spec.unit === "rad" ? "°" : unitText(spec.unit);
    const names = signals.map(({ label }) => label);
    const listed = names.slice(0, 8).join(", ") + (names.length > 8 ? ` and ${names.length - 8} more` : "");
    const ariaLabel = `${title} against time: ${listed}. Values at the cursor stand above.`;
    this.legend = h("div.legend");
    this.canvas = h("canvas", { role: "img", ariaLabel });
    this.ghost = h("div.ghost");
    this.cursor = h("div.cursor");
    this.brush = h("div.brush", { hidden: true });
    this.tip = h("div.tip", { hidden: true });
    this.plot = h("div.plot", {}, this.canvas, this.brush, this.ghost, this.cursor, this.tip);
    const heading = h("h3", {}, title, unit && h("span.unit", {}, ` [${unit}]`));
    this.element = h("figure.chart", {}, h("figcaption", {}, heading, this.legend), this.plot);
    handlePlot(this);
  }

  /** @param {{run: Run, index: number, name: string}[]} shown  @param {boolean} several true if the page has several */
  setRuns(shown, several) {
    Object.assign(this, { _shown: shown, _several: several });
    this.collect();
    this.makeLegend();
  }

  /** Return the drawn curves: index of the run in the page, signal, label, times [s] and values. */
  series() {
    return this.curves.map(({ index, run, signal: { name, label }, values }) => ({
      run: index, name, label, time: run.time, values,
    }));
  }

  /** Show a time window [s]; `rest` is the start of the final rest [s], or null for a time axis without break. */
  setWindow(from, to, rest = null) {
    Object.assign(this, { window: [from, to], rest, stale: true });
  }

  /** Paint the canvas if it is stale; with `cursor` [s], paint a cursor there too. */
  paint(cursor = null) {
    if (!this.stale || this.plot.clientWidth < 80 || this.plot.clientHeight < 40) return;
    const { context, width, height } = clearedCanvas(this.canvas);
    const { fixed, zero, down } = this.spec;
    const range = fixed ? widened(fixed) : rangeOf(this.curves, this.window, zero);
    this.frame = new Frame(width, height, this.window, this.rest, range, down);
    paintPlot(context, this.frame, this.spec, this.curves);
    const { top, bottom, x } = this.frame;
    context.fillStyle = COLORS.ink;
    if (cursor !== null) context.fillRect(x(cursor) - 0.75, top, 1.5, bottom - top);
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
      setText(value, curve ? reading(valueAt(curve, t), this.spec.unit) : "");
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
    const [off, part] = x > this.frame.width / 2 ? [-8, "-100%"] : [8, "0"];
    this.tip.style.transform = `translate(${x + off}px, 0) translateX(${part})`;
  }

  _place(line, t) {
    const shown = t !== null && this.frame && t >= this.window[0] - 1e-9 && t <= this.window[1] + 1e-9;
    line.style.visibility = shown ? "visible" : "hidden";
    if (shown) line.style.transform = `translateX(${this.frame.x(t).toFixed(1)}px)`;
  }

  _nearest(t, y) {
    let best = { gap: 26, text: "" };
    for (const curve of this.curves) {
      const value = valueAt(curve, t);
      const gap = Math.abs(this.frame.y(value) - y) + (curve.signal.faint ? 4 : 0);
      const whose = this._several ? `${curve.name}: ` : "";
      if (gap < best.gap) best = { gap, text: `${whose}${curve.signal.label} ${quantity(value, this.spec.unit)}` };
    }
    return best.text;
  }

  /** Collect the curves, again after rows were appended. */
  collect() {
    const signals = this.spec.signals.filter(({ name }) => !this._off.has(name));
    const curves = this._shown.flatMap((one) => signals.map((of) => ({
      ...one, signal: of, values: of.values(one.run),
      dash: this._several && !of.context ? runDash(one.index) : of.dash,
    })));
    this.curves = curves.filter(({ values }) => values);
    this.stale = true;
  }

  /** Make the legend, in the colors of the theme. */
  makeLegend() {
    const faint = this.spec.signals.filter((of) => of.faint).length;
    this._entries = this.spec.signals.filter((of) => !of.faint).map((of) => ({ of, value: h("span.value") }));
    const items = this._entries.map(({ of, value }) => {
      const { name, label, context } = of;
      const line = swatch(hueColor(of.hue, of.shade), this._several && !context ? [] : of.dash);
      const onclick = () => {
        if (!this._off.delete(name)) this._off.add(name);
        key.ariaPressed = !this._off.has(name);
        this.collect();
        this.on.changed();
      };
      const props = { title: `Put ${label} in or out`, ariaPressed: !this._off.has(name), onclick };
      const key = h("button.key", props, line, label, value);
      return key;
    });
    const rest = faint ? [h("span.key", {}, swatch(COLORS.gray, []), `${faint} farther regions`)] : [];
    this.legend.replaceChildren(...items, ...rest);
    this.stale = true;
  }
}

/** Return the value of a curve at a time [s]; a growing run may have rows that the curve lacks. */
const valueAt = ({ run, values }, t) => values[Math.min(run.row(t), values.length - 1)] ?? NaN;

/** Listen to the pointer: drag seeks, Shift+drag selects a window, Ctrl or Shift+wheel zooms, double click resets. */
function handlePlot(chart) {
  const { plot, brush, on } = chart;
  let press = null; // {x, mode}
  const x = (event) => event.clientX - plot.getBoundingClientRect().left;
  const seek = (event) => on.seek(chart.frame.time(x(event)));
  const done = () => {
    press = null;
    brush.hidden = true;
  };
  listen(plot, {
    pointerdown(event) {
      if (event.button !== 0 || !chart.frame) return;
      // a finger may be about to scroll the page
      press = { x: x(event), mode: event.pointerType === "touch" ? "perhaps" : event.shiftKey ? "window" : "seek" };
      plot.setPointerCapture(event.pointerId);
      if (press.mode === "seek") seek(event);
    },
    pointermove(event) {
      if (!chart.frame) return;
      if (!press) {
        const y = event.clientY - plot.getBoundingClientRect().top;
        if (event.pointerType !== "touch") on.hover(chart.frame.time(x(event)), chart, y);
        return;
      }
      const dx = x(event) - press.x;
      if (press.mode === "perhaps" && Math.abs(dx) > 8) press.mode = "seek";
      if (press.mode === "seek") seek(event);
      if (press.mode !== "window") return;
      brush.hidden = false;
      Object.assign(brush.style, { left: `${Math.min(x(event), press.x)}px`, width: `${Math.abs(dx)}px` });
    },
    pointerup(event) {
      if (press?.mode === "perhaps") seek(event);
      if (press?.mode === "window" && Math.abs(x(event) - press.x) > 4) {
        const [from, to] = [x(event), press.x].map(chart.frame.time);
        on.window(Math.min(from, to), Math.max(from, to));
      }
      done();
    },
    pointercancel: done,
    pointerleave: () => on.hover(null),
    dblclick: () => on.whole(),
  });
  const wheel = (event) => {
    const { deltaX, deltaY, ctrlKey, shiftKey, metaKey } = event;
    const turn = deltaY || deltaX;
    const zooms = ctrlKey || shiftKey || metaKey;
    if (!chart.frame || (!zooms && Math.abs(deltaX) <= Math.abs(deltaY))) return;
    event.preventDefault();
    const { left, right, time } = chart.frame;
    if (zooms) on.zoom(Math.exp(clamp(turn / 300, -0.4, 0.4)), time(x(event)));
    else on.pan((deltaX / (right - left)) * (chart.window[1] - chart.window[0]));
  };
  listen(plot, { wheel }, { passive: false });
}
