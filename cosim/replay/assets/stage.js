// Scenes of the page: all runs in one, or side by side with one camera.

/** Canvases of the scenes; the first canvas is never replaced. */
class Stage {
  /** @param {function} changed called when the picture needs a repaint */
  constructor(changed) {
    this.changed = changed;
    this.side = false;
    this.labels = true;
    this.holder = byId("views");
    this.views = [this._view(this.holder.querySelector(".view"))];
    this.canvas = this.views[0].canvas;
    new ResizeObserver(() => this.resize()).observe(this.holder);
    this._covers = new ResizeObserver(() => this._cover());
    for (const group of document.querySelectorAll("#scene-bar .group")) this.coveredBy(group);
  }

  /** Keep labels out from behind an element that covers a part of the scene. */
  coveredBy(element) { this._covers.observe(element); }

  /** Return the scene of the first canvas; null while there is nothing to draw. */
  get scene() { return this.views[0].blank ? null : this.views[0].scene; }

  get scenes() { return this.views.filter(({ blank }) => !blank).map(({ scene }) => scene); }

  /**
   * Show runs.
   * @param {Run[]} runs all runs  @param {boolean[]} shown visible runs
   * @param {boolean} same true for runs of the scenario that is shown: the view stays, as far as it shows them
   */
  setRuns(runs, shown, same = runs === this.runs) {
    const keepsScene = same && this.scene;
    Object.assign(this, { runs, shown });
    const names = runNames(runs);
    const visible = [...runs.keys()].filter((index) => shown[index] && drawable(runs[index]));
    const apart = this.side && visible.length > 1;
    const groups = apart ? visible.map((index) => [index]) : [visible];
    while (this.views.length > groups.length) this.views.pop().element.remove();
    while (this.views.length < groups.length) this.views.push(this._view(this._another()));
    groups.forEach((indices, i) => {
      const view = this.views[i];
      const marks = runs.length > 1 ? indices.map((index) => ({ name: names[index], color: runColor(index) })) : [];
      const captions = marks.map(({ name, color }, k) =>
        h("span.run-name", {}, swatch(color, runDash(indices[k])), name));
      view.caption.replaceChildren(...captions);
      Object.assign(view, { indices, blank: !indices.length });
      if (view.blank) return;
      view.scene ??= new Scene(view.canvas);
      // a run with a scene of its own colors its path by the active region
      view.scene.setRuns(indices.map((index) => runs[index]), marks.length && !apart ? marks : null);
    });
    this.canvas.hidden = !this.scene;
    this.resize();
    if (!this.scene) return;
    const { camera } = this.scene; // all scenes share it, and it frames the content of all
    camera.content = this.scenes.flatMap((scene) => scene.content);
    for (const scene of this.scenes) scene.camera = camera;
    if (keepsScene) camera.refit();
    else camera.look("iso");
    this.changed();
  }

  setSide(on) {
    this.side = on;
    this.setRuns(this.runs, this.shown);
  }

  /** Repaint in the colors of the theme. */
  repaint() {
    for (const scene of this.scenes) scene.resize();
  }

  resize() {
    this.repaint();
    this._cover();
  }

  draw(t, follow) {
    this.time = t;
    this.views.forEach(({ blank, scene, covered }, i) => {
      // one camera can follow one vehicle only
      if (!blank) scene.draw(t, { follow: follow && i === 0, labels: this.labels, covered });
    });
  }

  /** Measure the overlays on each canvas: [x, y, width, height] [CSS pixels]. */
  _cover() {
    const over = [...document.querySelectorAll("#scene-bar .group, #commands, .caption .run-name")];
    const boxes = over.map((element) => element.getBoundingClientRect());
    for (const view of this.views) {
      const { left, top } = view.canvas.getBoundingClientRect();
      view.covered = boxes.map((box) => [box.left - left - 4, box.top - top - 4, box.width + 8, box.height + 8]);
    }
    const { open, hidden, offsetWidth } = byId("commands") ?? {};
    this.camera("cover", open && !hidden && 2 * offsetWidth < this.canvas.clientWidth ? offsetWidth : 0);
    this.changed();
  }

  /** Call a method of the shared camera. */
  camera(method, ...values) {
    this.scene?.camera[method](...values);
  }

  /** Return the run, the region and the goal's place at a pixel of a view; null if there is none. */
  under(view, x, y) {
    const hit = view.blank ? null : view.scene.pick(x, y);
    return hit && { ...hit, run: this.runs[view.indices[hit.run]] };
  }

  _another() {
    const canvas = h("canvas", { tabIndex: 0, role: "img", ariaLabel: "Another run in three dimensions" });
    const element = h("div.view", {}, canvas, h("p.caption"));
    this.holder.append(element);
    return element;
  }

  _view(element) {
    const [canvas, caption] = ["canvas", ".caption"].map((part) => element.querySelector(part));
    const view = { element, canvas, caption, scene: null, blank: true, indices: [], covered: [] };
    showPointed(this, view);
    return view;
  }
}

/** Show the name of the region under the pointer while no button is pressed. */
function showPointed(stage, view) {
  const tip = byId("pointed");
  let next = 0;
  const show = (x, y) => {
    const hit = stage.under(view, x, y);
    tip.hidden = !hit;
    if (!hit) return;
    const { run, region, place } = hit;
    const name = regionName(run.header.regions[region], place, place > run.goalPlace(stage.time) ? "next" : "present");
    setText(tip, `${name}: ${regionWords(run, region, stage.time)}`);
    const inner = view.canvas.getBoundingClientRect();
    const outer = tip.offsetParent.getBoundingClientRect();
    const left = Math.min(x + inner.left - outer.left + 14, outer.width - tip.offsetWidth - 6);
    const top = Math.min(y + inner.top - outer.top + 16, outer.height - tip.offsetHeight - 6);
    tip.style.transform = `translate(${Math.max(6, left)}px, ${top}px)`;
  };
  const hide = () => {
    cancelAnimationFrame(next);
    tip.hidden = true;
  };
  listen(view.canvas, {
    pointermove({ buttons, offsetX, offsetY }) {
      cancelAnimationFrame(next);
      if (buttons) tip.hidden = true;
      else next = requestAnimationFrame(() => show(offsetX, offsetY));
    },
    pointerleave: hide,
    pointerdown: hide,
  });
}
