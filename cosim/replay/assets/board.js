// All charts of the page, with one time window and one cursor.

const SHORTEST = 0.02; // s, of a window of time

/** Charts below the scene, with one time window and one cursor. */
class Board {
  /** @param {Player} player */
  constructor(player) {
    this.player = player;
    this.charts = [];
    this.window = null; // null for the whole run
    // hidden until the reader selects them
    this._out = new Set(["memberships", "commanded", "acting", "moments", "turning"]);
    this._updated = 0;
    this._pending = 0;
    this._watcher = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) target.chart.near = isIntersecting;
      this._later();
    }, { rootMargin: "200px" });
    this._sizes = new ResizeObserver((entries) => {
      for (const { target } of entries) target.chart.stale = true;
      this._later();
    });
  }

  /**
   * @param {Run[]} runs all runs  @param {boolean[]} shown visible runs
   * @param {number} selected run whose values are shown
   */
  setRuns(runs, shown, selected) {
    const specs = chartsOf(runs);
    const keys = JSON.stringify(specs.map((spec) => [spec.key, spec.signals.map((of) => [of.name, of.faint])]));
    Object.assign(this, { runs, shown, selected });
    if (keys !== this._keys) this._rebuild(specs);
    this._keys = keys;
    this._asked = performance.now();
    const names = runNames(runs);
    const some = runs.map((run, index) => ({ run, index, name: names[index] })).filter(({ index }) => shown[index]);
    for (const chart of this.charts) chart.setRuns(some, runs.length > 1);
    this._frame();
  }

  /** Repaint in the colors of the theme. */
  repaint() {
    for (const chart of this.charts) chart.makeLegend();
    this._later();
  }

  /** Repaint after rows were appended, at most eight times a second. */
  grown() {
    this._pending ||= setTimeout(() => {
      this._pending = 0;
      // other regions may have become the nearest ones
      if (performance.now() - this._asked > 3000) this.setRuns(this.runs, this.shown, this.selected);
      for (const chart of this.charts) chart.collect();
      this._frame();
    }, 125);
  }

  /** Multiply the length of the time window by a factor, about a time [s]. */
  zoom(factor, about = this.player.t) {
    const [from, to] = this.shownWindow();
    const length = Math.max((to - from) * factor, SHORTEST);
    if (length >= this.player.duration) this.whole();
    else this._show(about - clamp((about - from) / (to - from), 0, 1) * length, length);
  }

  pan(seconds) {
    if (this.window) this._show(this.window[0] + seconds, this.window[1] - this.window[0]);
  }

  setWindow(from, to) {
    this._show(from, Math.max(to - from, SHORTEST));
  }

  whole() {
    this.window = null;
    this._frame();
  }

  /** Return the shown time window [from, to] [s]. */
  shownWindow() {
    const { start, end } = this.player;
    return this.window ?? [start, end > start ? end : start + 1];
  }

  /** Move the cursor and update the values; called every frame. */
  point() {
    const { t, playing, live } = this.player;
    if ((playing || live) && this.window && (t > this.window[1] || t < this.window[0])) {
      const length = this.window[1] - this.window[0];
      this._show(live ? t - length : t, length); // the next page; of a live run the last seconds
    }
    const now = performance.now();
    const due = !playing || now - this._updated > 90; // limits the rate of text updates
    if (due) this._updated = now;
    for (const chart of this.charts.filter(({ near, element }) => near && !element.hidden)) {
      chart.paint();
      chart.point(live && !this.window ? Math.min(t, chart.window[1]) : t); // the newest rows are not drawn yet
      if (due && !this._hovering) chart.update(t, this.selected);
    }
  }

  /** Paint every chart, also those off screen; `onPaper` draws the cursor into the canvas. */
  paintAll(onPaper) {
    const { t } = this.player;
    for (const chart of this.charts) {
      chart.stale = true;
      chart.paint(onPaper ? t : null);
      chart.point(t);
      chart.update(t, this.selected);
    }
  }

  _show(from, length) {
    const { start, end } = this.player;
    const first = clamp(from, start, Math.max(start, end - length));
    this.window = [first, first + length];
    this._frame();
  }

  _frame() {
    const [from, to] = this.shownWindow();
    const rest = this.window ? null : this.player.rest;
    for (const chart of this.charts) chart.setWindow(from, to, rest);
    byId("charts-whole").disabled = !this.window;
    byId("charts-window").textContent = this.window ? `${clock(from)} to ${clock(to)}` : "whole run";
    this._later();
  }

  _later() {
    cancelAnimationFrame(this._next);
    this._next = requestAnimationFrame(() => this.point());
  }

  _rebuild(specs) {
    this._watcher.disconnect();
    this._sizes.disconnect();
    const { player } = this;
    const on = {
      seek: (t) => player.seek(t),
      hover: (t, chart, y) => this._hover(t, chart, y),
      zoom: (factor, t) => this.zoom(factor, t),
      pan: (seconds) => this.pan(seconds),
      window: (from, to) => this.setWindow(from, to),
      whole: () => this.whole(),
      changed: () => this._later(),
    };
    this.charts = specs.map((spec) => new Chart(spec, on));
    byId("charts").replaceChildren(...this.charts.map((chart) => chart.element));
    byId("charts-choice").replaceChildren(...this.charts.map((chart) => this._choice(chart)));
    for (const chart of this.charts) {
      chart.element.chart = chart.plot.chart = chart;
      this._watcher.observe(chart.element);
      this._sizes.observe(chart.plot);
    }
  }

  /** Return the box that shows or hides a chart. */
  _choice({ element, spec: { key, title } }) {
    element.hidden = this._out.has(key);
    const box = checkbox(!element.hidden, title, () => {
      element.hidden = !box.checked;
      if (box.checked) this._out.delete(key);
      else this._out.add(key);
      this._later();
    });
    return h("label.choice", {}, box, title);
  }

  _hover(t, over, y) {
    this._hovering = t !== null;
    for (const chart of this.charts.filter(({ near }) => near)) {
      chart.hover(t, chart === over ? y : null);
      chart.update(t ?? this.player.t, this.selected);
    }
  }
}
