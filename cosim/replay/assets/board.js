// All charts of the page, with one time window and one cursor.

/** Charts below the scene, with one time window and one cursor. */
class Board {
  /** @param {Player} player  @param {string} theme "light" or "dark" */
  constructor(player, theme) {
    this.player = player;
    this.theme = theme;
    this.charts = [];
    this.window = null; // null for the whole run
    this.holder = document.getElementById("charts");
    this._out = new Set(["memberships", "asked", "acting", "moments", "turning"]); // hidden until the reader selects them
    this._updated = 0;
    this._pending = 0;
    const watch = (entries) => this._seen(entries);
    this._watcher = new IntersectionObserver(watch, { rootMargin: "200px" });
    this._sizes = new ResizeObserver((entries) => this._resized(entries));
    const press = (id, fn) => document.getElementById(id).addEventListener("click", fn);
    press("charts-in", () => this.zoom(0.5));
    press("charts-out", () => this.zoom(2));
    press("charts-whole", () => this.whole());
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

  setTheme(theme) {
    this.theme = theme;
    for (const chart of this.charts) chart.setTheme(theme);
    this._later();
  }

  /** Repaint after rows were appended, at most eight times a second. */
  grown() {
    if (this._pending) return;
    this._pending = setTimeout(() => {
      this._pending = 0;
      // other regions may have become the nearest ones
      if (performance.now() - this._asked > 3000) this.setRuns(this.runs, this.shown, this.selected);
      for (const chart of this.charts) chart.grown();
      this._frame();
    }, 125);
  }

  /** Multiply the length of the time window by a factor, about a time [s]. */
  zoom(factor, about = this.player.t) {
    const [from, to] = this.shownWindow();
    const length = Math.max((to - from) * factor, 0.02);
    if (length >= this.player.duration) return this.whole();
    const share = to > from ? Math.min(1, Math.max(0, (about - from) / (to - from))) : 0.5;
    return this._show(about - share * length, length);
  }

  pan(seconds) {
    if (this.window) this._show(this.window[0] + seconds, this.window[1] - this.window[0]);
  }

  setWindow(from, to) {
    this._show(from, Math.max(to - from, 0.02));
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
    for (const chart of this.charts) {
      if (!chart.near || chart.element.hidden) continue;
      chart.paint();
      chart.point(live && !this.window ? Math.min(t, chart.window[1]) : t); // the newest rows are not drawn yet
      if (due && !this._hovering) chart.update(t, this.selected);
    }
  }

  /** Paint every chart, also those off screen; `onPaper` draws the cursor into the canvas. */
  paintAll(onPaper) {
    for (const chart of this.charts) {
      chart.stale = true;
      chart.paint(onPaper ? this.player.t : null);
      chart.point(this.player.t);
      chart.update(this.player.t, this.selected);
    }
  }

  _show(from, length) {
    const { start, end } = this.player;
    const first = Math.min(Math.max(from, start), Math.max(start, end - length));
    this.window = [first, first + length];
    this._frame();
  }

  _frame() {
    const [from, to] = this.shownWindow();
    for (const chart of this.charts) chart.setWindow(from, to, this.window ? null : this.player.rest);
    document.getElementById("charts-whole").disabled = !this.window;
    document.getElementById("charts-window").textContent = this.window ? `${clock(from)} to ${clock(to)}` : "whole run";
    this._later();
  }

  _later() {
    cancelAnimationFrame(this._next);
    this._next = requestAnimationFrame(() => this.point());
  }

  _rebuild(specs) {
    this._watcher.disconnect();
    this._sizes.disconnect();
    const on = {
      seek: (t) => this.player.seek(t),
      hover: (t, chart, y) => this._hover(t, chart, y),
      zoom: (factor, t) => this.zoom(factor, t),
      pan: (seconds) => this.pan(seconds),
      window: (from, to) => this.setWindow(from, to),
      whole: () => this.whole(),
      changed: () => this._later(),
    };
    this.charts = specs.map((spec) => new Chart(spec, this.theme, on));
    this.holder.replaceChildren(...this.charts.map((chart) => chart.element));
    this._choices();
    for (const chart of this.charts) {
      this._watcher.observe(chart.element);
      this._sizes.observe(chart.plot);
    }
  }

  _choices() {
    const list = document.getElementById("charts-choice");
    list.replaceChildren(
      ...this.charts.map((chart) => {
        const label = element("label", "choice");
        const box = element("input");
        box.type = "checkbox";
        box.checked = !this._out.has(chart.spec.key);
        chart.element.hidden = !box.checked;
        box.addEventListener("change", () => {
          chart.element.hidden = !box.checked;
          if (box.checked) this._out.delete(chart.spec.key);
          else this._out.add(chart.spec.key);
          this._later();
        });
        label.append(box, chart.spec.title);
        return label;
      }),
    );
  }

  _hover(t, over, y) {
    this._hovering = t !== null;
    for (const chart of this.charts) {
      if (!chart.near) continue;
      chart.hover(t, chart === over ? y : null);
      chart.update(t ?? this.player.t, this.selected);
    }
  }

  _seen(entries) {
    for (const { target, isIntersecting } of entries) {
      const chart = this.charts.find((one) => one.element === target);
      if (chart) chart.near = isIntersecting;
    }
    this._later();
  }

  _resized(entries) {
    for (const { target } of entries) {
      const chart = this.charts.find((one) => one.plot === target);
      if (chart) chart.stale = true;
    }
    this._later();
  }
}
