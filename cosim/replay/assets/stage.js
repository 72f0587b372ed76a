// The scenes of the page: all runs in one, or side by side with one camera, and the hands that move it.

/** Holds one canvas for each scene; the first canvas stays for as long as the page does. */
class Stage {
  /** @param {string} theme  @param {function} changed called when a picture is stale */
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
  }

  /** The scene of the first canvas; null while there is nothing to draw. */
  get scene() {
    return this.views[0].scene;
  }

  get scenes() {
    return this.views.map((view) => view.scene).filter(Boolean);
  }

  /** @param {Run[]} runs of the page  @param {boolean[]} shown which of them are */
  setRuns(runs, shown) {
    this.runs = runs;
    this.shown = shown;
    const names = runNames(runs);
    const seen = runs.map((run, index) => ({ run, index })).filter(({ run, index }) => shown[index] && drawable(run));
    const groups = this.side && seen.length > 1 ? seen.map((one) => [one]) : [seen];
    while (this.views.length > groups.length) this.views.pop().element.remove();
    while (this.views.length < groups.length) this.views.push(this._view(this._another()));
    this.holder.dataset.views = String(groups.length);
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
      if (!some.length) view.scene = null;
      else if (view.scene) view.scene.setRuns(some);
      else view.scene = new Scene(view.canvas, some, this.theme);
      if (i > 0) view.scene.camera = this.scene.camera;
    });
    this.canvas.hidden = !this.scene;
    this.resize();
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
    this.changed();
  }

  draw(t, follow) {
    for (const scene of this.scenes) scene.draw(t, { follow, trail: true, labels: this.labels });
  }

  /** Call a method of the one camera. */
  camera(method, ...values) {
    if (!this.scene) return;
    this.scene.camera[method](...values);
    this.changed();
  }

  /** The run and the region under a point of a canvas: names to show, or null. */
  under(view, x, y) {
    const found = view.scene?.pick(x, y);
    return found ? { run: this.runs[view.indices[found.run]], region: found.region } : null;
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
    const view = { element: made, canvas: made.querySelector("canvas"), caption: made.querySelector(".caption"), scene: null, indices: [] };
    handleScene(this, view);
    return view;
  }
}

/**
 * Pointer on a scene: drag turns; with Shift or the right button it moves; the wheel, or two fingers, comes nearer.
 *
 * Who must have a press for itself listens on the canvas with capture, and stops it there.
 */
function handleScene(stage, view) {
  const { canvas } = view;
  const held = new Map(); // pointers that are down, and where
  const tip = document.getElementById("pointed");
  let hovering = 0;
  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  };
  const spread = () => {
    const [a, b] = [...held.values()];
    return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, size: Math.max(1, Math.hypot(a.x - b.x, a.y - b.y)) };
  };
  const point = ({ x, y }) => {
    const found = stage.under(view, x, y);
    tip.hidden = !found;
    canvas.classList.toggle("over", Boolean(found));
    if (!found) return;
    const region = found.run.header.regions[found.region];
    setText(tip, `${region.name}: ${regionWords(region)}`);
    const box = canvas.getBoundingClientRect();
    const outer = tip.offsetParent.getBoundingClientRect();
    const left = Math.min(x + box.left - outer.left + 14, outer.width - tip.offsetWidth - 6);
    tip.style.transform = `translate(${Math.max(6, left)}px, ${y + box.top - outer.top + 14}px)`;
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, place(event));
    tip.hidden = true;
  });
  canvas.addEventListener("pointermove", (event) => {
    const now = place(event);
    const before = held.get(event.pointerId);
    if (!before) {
      cancelAnimationFrame(hovering);
      hovering = requestAnimationFrame(() => point(now));
      return;
    }
    if (held.size === 2) {
      const was = spread();
      held.set(event.pointerId, now);
      const is = spread();
      stage.camera("zoom", is.size / was.size);
      stage.camera("pan", is.x - was.x, is.y - was.y);
      return;
    }
    held.set(event.pointerId, now);
    const moves = event.shiftKey || event.buttons & 6; // right or middle button
    stage.camera(moves ? "pan" : "orbit", now.x - before.x, now.y - before.y);
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => held.delete(event.pointerId));
  canvas.addEventListener("pointerleave", () => {
    cancelAnimationFrame(hovering);
    tip.hidden = true;
  });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("dblclick", () => stage.camera("fit"));
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      stage.camera("zoom", Math.exp(-Math.sign(event.deltaY) * Math.min(0.25, Math.abs(event.deltaY) / 500)));
    },
    { passive: false },
  );
}
