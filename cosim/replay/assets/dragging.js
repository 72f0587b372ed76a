// Dragging of target and regions in the scene, of a live run or of a what-if simulation.

const BEGINS = 4; // pixels, below which a press is a click
const EDGE_ON = 0.12; // sine of the camera's elevation below which a level plane is too edge-on for dragging
const FARTHEST = 500; // m, limit of one drag
const SETTLES = 250; // ms, for which the ghost stays after the release

/** Pointer drags of regions, with a preview of the new position. */
class Dragging {
  /**
   * @param {LiveLink|WhatIf} link with page, run, acceptsCommands; time, for which the regions are shown [s]; refusal, the
   * reason why nothing can be moved, or ""; canMove(region, place); move(region, from, to, place), with the place of a goal in turn
   */
  constructor(link) {
    this.link = link;
    this.canvas = link.page.canvas;
    this.ghost = new Ghost(this.canvas);
    this.held = null;
    const { canvas } = this;
    // in the capturing phase, before the camera's listeners, which skip events that are handled
    canvas.addEventListener("pointerdown", (event) => this._take(event), true);
    canvas.addEventListener("pointermove", (event) => this._move(event));
    canvas.addEventListener("pointerup", (event) => this._drop(event));
    canvas.addEventListener("pointercancel", () => this.cancel());
    addEventListener("keydown", (event) => {
      if (event.key === "Escape") this.cancel();
    });
  }

  /** End the drag without a command. */
  cancel() {
    this.held = null;
    this.ghost.clear();
  }

  /** Redraw the ghost, as the camera may have moved. */
  draw() {
    if (this.held?.moved) this.ghost.draw(this.link.page.scene(), this.held);
  }

  /** Return the region at a pixel that may be dragged, and the place of a goal in turn; null if there is none. */
  _under(x, y) {
    const { link } = this;
    const scene = link.page.scene();
    if (!link.acceptsCommands || !scene) return null;
    const found = scene.pick(x, y);
    if (!found || !link.canMove(found.region, found.place) || isFlat(link.run, found.region)) return null;
    // a keep-inside region surrounds the scene, so that its label is the only handle
    const { keep } = link.run.header.regions[found.region];
    const named = scene.labels.nameAt(x, y) !== null; // labels are picked before what is behind them
    return found.region === 0 || keep === "out" || named ? found : null;
  }

  _take(event) {
    if (event.button !== 0 || !event.isPrimary || event.altKey || event.ctrlKey) return;
    const { offsetX: x, offsetY: y } = event;
    const found = this._under(x, y);
    if (!found) return;
    const { run, page, refusal, time } = this.link;
    if (refusal) {
      page.say(refusal, "info");
      return;
    }
    event.preventDefault();
    this.canvas.focus();
    this.canvas.setPointerCapture(event.pointerId);
    const { region, place } = found;
    const from = placeOf(run, region, time, place);
    this.held = { run, region, place, time, from, to: from, x, y, last: [x, y], upright: null, moved: false };
  }

  _move(event) {
    const { held } = this;
    const { offsetX: x, offsetY: y } = event;
    if (!held) {
      if (!event.buttons) this._hint(x, y);
      return;
    }
    held.moved ||= Math.hypot(x - held.x, y - held.y) >= BEGINS;
    if (!held.moved) return;
    held.to = this._dragged(held, x, y, event.shiftKey);
    held.last = [x, y];
    this.canvas.style.cursor = "grabbing";
    this.draw();
  }

  /** Return the new position: on a level plane, vertical with `up`, or on the upright plane in an edge-on view. */
  _dragged(held, x, y, up) {
    const scene = this.link.page.scene();
    const edgeOn = Math.abs(scene.camera.forward[2]) < EDGE_ON;
    let by = [0, 0, 0];
    if (up || edgeOn) {
      const [a, b] = [held.last, [x, y]].map(([u, v]) => onUprightPlane(scene.camera, u, v, held.to));
      if (a && b) by = Vec.sub(b, a);
      if (up) by = [0, 0, by[2]];
    } else {
      const [a, b] = [held.last, [x, y]].map(([u, v]) => scene.placeOnPlane(u, v, held.to[2]));
      if (a && b) by = [b[0] - a[0], b[1] - a[1], 0];
    }
    const to = Vec.add(held.to, by);
    return Vec.norm(Vec.sub(to, held.from)) <= FARTHEST ? to : held.to;
  }

  _drop(event) {
    const { held, link } = this;
    if (!held) return;
    this.held = null;
    this.canvas.releasePointerCapture(event.pointerId);
    this.canvas.style.cursor = "";
    if (held.moved && held.run === link.run) {
      const round = held.to.map((x, i) => (x === held.from[i] ? x : Number(x.toFixed(3))));
      link.move(held.region, held.from, round, held.place);
    }
    setTimeout(() => {
      if (!this.held) this.ghost.clear();
    }, SETTLES);
  }

  /** Set the cursor shape over draggable regions, at most every 80 ms, as picking takes time. */
  _hint(x, y) {
    this._at = [x, y];
    this._looking ||= setTimeout(() => {
      this._looking = 0;
      if (!this.held) this.canvas.style.cursor = this._under(...this._at) ? "grab" : "";
    }, 80);
  }
}

/** Return the point [m, NED] at a pixel on the upright plane through a point that faces the eye; null if there is none. */
function onUprightPlane(camera, x, y, through) {
  const level = [camera.forward[0], camera.forward[1], 0];
  if (Vec.norm(level) < 1e-3) return null; // from straight above no upright plane is seen
  const normal = Vec.unit(level);
  const ray = camera.ray(x, y);
  const length = Vec.dot(Vec.sub(through, camera.eye), normal) / Vec.dot(ray, normal);
  return length > 0 && Number.isFinite(length) ? Vec.along(camera.eye, ray, length) : null;
}
