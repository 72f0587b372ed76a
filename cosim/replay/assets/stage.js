// Scenes of the page: all runs in one, or side by side with one camera.

/** Canvases of the scenes; the first canvas is never replaced. */
class Stage {
  /** @param {string} theme  @param {function} changed called when the picture needs a repaint */
  constructor(theme, changed) {
    this.theme = theme;
    this.changed = changed;
    this.side = false;
    this.labels = true;
    this.holder = document.getElementById("views");
    const first = this.holder.querySelector(".view");
    this.views = [this._view(first)];
    this.canvas = this.views[0].canvas;
    this._sizes = new ResizeObserver(() => this.resize());
    this._sizes.observe(this.holder);
    this._covers = new ResizeObserver(() => this._cover());
    for (const group of document.querySelectorAll("#scene-bar .group")) this._covers.observe(group);
  }

  /** Keep labels out from behind an element that covers a part of the scene. */
  coveredBy(hung) {
    this._covers.observe(hung);
  }

  /** Return the scene of the first canvas; null while there is nothing to draw. */
  get scene() {
    return this.views[0].blank ? null : this.views[0].scene;
  }

  get scenes() {
    return this.views.filter((view) => !view.blank).map((view) => view.scene);
  }

  /**
   * Show runs.
   * @param {Run[]} runs all runs  @param {boolean[]} shown visible runs
   * @param {boolean} same true for runs of the scenario that is shown: the view stays, as far as they are in the picture
   */
  setRuns(runs, shown, same = runs === this.runs) {
    const kept = same && this.scene;
    this.runs = runs;
    this.shown = shown;
    const names = runNames(runs);
    const seen = runs.map((run, index) => ({ run, index })).filter(({ run, index }) => shown[index] && drawable(run));
    const apart = this.side && seen.length > 1;
    const groups = apart ? seen.map((one) => [one]) : [seen];
    while (this.views.length > groups.length) this.views.pop().element.remove();
    while (this.views.length < groups.length) this.views.push(this._view(this._another()));
    const content = [];
    groups.forEach((group, i) => {
      const view = this.views[i];
      view.indices = group.map(({ index }) => index);
      const some = group.map(({ run }) => run);
      view.caption.replaceChildren();
      if (runs.length > 1) {
        for (const { index } of group) {
          const name = element("span", "run-name");
          name.append(swatch(runColour(index), runDash(index)), names[index]);
          view.caption.append(name);
        }
      }
      // a run with a scene of its own colors its path by the active region
      const marks = runs.length > 1 && !apart ? group.map(({ index }) => ({ name: names[index], colour: runColour(index) })) : null;
      view.blank = !some.length;
      if (view.blank) return;
      if (view.scene) view.scene.setRuns(some, marks);
      else view.scene = new Scene(view.canvas, some, this.theme, marks);
      content.push(...view.scene.camera.content);
      if (i > 0) view.scene.camera = this.scene.camera;
    });
    this.canvas.hidden = !this.scene;
    this.resize();
    if (!this.scene) return;
    this.scene.camera.content = content; // the shared camera frames the content of all scenes
    if (kept) this.camera("refit");
    else this.camera("look", "iso");
    this.changed();
  }

  setSide(on) {
    this.side = on;
    this.setRuns(this.runs, this.shown);
  }

  setTheme(theme) {
    this.theme = theme;
    for (const scene of this.scenes) scene.setTheme(theme);
    this.changed();
  }

  resize() {
    for (const scene of this.scenes) scene.resize();
    this._cover();
  }

  draw(t, follow) {
    // one camera can follow one vehicle only
    const { labels } = this;
    this.time = t;
    this.views.forEach(({ blank, scene, covered }, i) => {
      if (!blank) scene.draw(t, { follow: follow && i === 0, trail: true, labels, covered });
    });
  }

  /** Measure the overlays on each canvas: [x, y, width, height] [CSS pixels]. */
  _cover() {
    const over = [...document.querySelectorAll("#scene-bar .group, #commands, .caption .run-name")].map((hung) => hung.getBoundingClientRect());
    for (const view of this.views) {
      const { left, top } = view.canvas.getBoundingClientRect();
      view.covered = over.map((box) => [box.left - left - 4, box.top - top - 4, box.width + 8, box.height + 8]);
    }
    const { open, hidden, offsetWidth } = document.getElementById("commands") ?? {};
    this.camera("cover", open && !hidden && 2 * offsetWidth < this.canvas.clientWidth ? offsetWidth : 0);
    this.changed();
  }

  /** Call a method of the shared camera. */
  camera(method, ...values) {
    if (!this.scene) return;
    this.scene.camera[method](...values);
  }

  /** Return the run, the region and the goal's place at a pixel of a view; null if there is none. */
  under(view, x, y) {
    const found = view.blank ? null : view.scene.pick(x, y);
    return found ? { ...found, run: this.runs[view.indices[found.run]] } : null;
  }

  _another() {
    const made = element("div", "view");
    const canvas = element("canvas");
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", "Another run in three dimensions");
    made.append(canvas, element("p", "caption"));
    this.holder.append(made);
    return made;
  }

  _view(made) {
    const view = { element: made, canvas: made.querySelector("canvas"), caption: made.querySelector(".caption"), scene: null, blank: true, indices: [], covered: [] };
    showPointed(this, view);
    return view;
  }
}

/** Show the name of the region under the pointer while no button is pressed. */
function showPointed(stage, view) {
  const { canvas } = view;
  const tip = document.getElementById("pointed");
  let next = 0;
  const show = (x, y) => {
    const found = stage.under(view, x, y);
    tip.hidden = !found;
    if (!found) return;
    const { run, region, place } = found;
    const name = regionName(run.header.regions[region], place, place > run.goalPlace(stage.time) ? "next" : "present");
    setText(tip, `${name}: ${regionWords(run, region, stage.time)}`);
    const inner = canvas.getBoundingClientRect();
    const outer = tip.offsetParent.getBoundingClientRect();
    const left = Math.min(x + inner.left - outer.left + 14, outer.width - tip.offsetWidth - 6);
    const top = Math.min(y + inner.top - outer.top + 16, outer.height - tip.offsetHeight - 6);
    tip.style.transform = `translate(${Math.max(6, left)}px, ${top}px)`;
  };
  const away = () => {
    cancelAnimationFrame(next);
    tip.hidden = true;
  };
  canvas.addEventListener("pointermove", (event) => {
    cancelAnimationFrame(next);
    if (event.buttons) tip.hidden = true;
    else next = requestAnimationFrame(() => show(event.offsetX, event.offsetY));
  });
  canvas.addEventListener("pointerleave", away);
  canvas.addEventListener("pointerdown", away);
}
