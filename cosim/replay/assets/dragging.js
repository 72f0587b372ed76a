// Dragging of target and regions in the scene, of a live run or of a what-if simulation.

const BEGINS = 4; // pixels, below which a press is a click
const EDGE_ON = 0.12; // sine of the camera's elevation below which a level plane is too edge-on for dragging
const FARTHEST = 500; // m, limit of one drag
const SETTLES = 250; // ms, for which the ghost stays after the release

/** Pointer drags of regions, with a preview of the new position. */
class Dragging {
  /**
   * @param {LiveLink|WhatIf} link with page, run, acceptsCommands; time, for which the regions are shown [s]; refusal,
   * the reason why nothing can be moved, or ""; canMove(region, place); move(region, from, to, place), with the place
   * of a goal in turn
   */
  constructor(link) {
    this.link = link;
    this.canvas = link.page.canvas;
    this.held = null;
    listen(this.canvas, {
      pointermove: (event) => this._move(event),
      pointerup: (event) => this._drop(event),
      pointercancel: () => this.cancel(),
    });
    // in the capturing phase, before the camera's listeners, which skip events that are handled
    listen(this.canvas, { pointerdown: (event) => this._take(event) }, { capture: true });
    addEventListener("keydown", ({ key }) => key === "Escape" && this.cancel());
  }

  /** End the drag without a command. */
  cancel() {
    this.held = null;
    this._show(null);
  }

  /** Show a ghost; null for none. */
  _show(ghost) {
    const scene = this.link.page.scene();
    if (!scene) return;
    scene.ghost = ghost;
    this.link.page.later();
  }

  /** Return the region at a pixel that may be dragged, and the place of a goal in turn; null if there is none. */
  _under(x, y) {
    const { link } = this;
    const scene = link.page.scene();
    const hit = link.acceptsCommands && scene?.pick(x, y);
    if (!hit || !link.canMove(hit.region, hit.place) || isFlat(link.run, hit.region)) return null;
    // a keep-inside region surrounds the scene, so that its label is the only handle
    const { keep } = link.run.header.regions[hit.region];
    const named = scene.labels.nameAt(x, y) !== null; // labels are picked before what is behind them
    return hit.region === 0 || keep === "out" || named ? hit : null;
  }

  _take(event) {
    if (event.button !== 0 || !event.isPrimary || event.altKey || event.ctrlKey) return;
    const { offsetX: x, offsetY: y } = event;
    const hit = this._under(x, y);
    if (!hit) return;
    const { run, page, refusal, time } = this.link;
    if (refusal) {
      page.say(refusal, "info");
      return;
    }
    event.preventDefault();
    this.canvas.focus();
    this.canvas.setPointerCapture(event.pointerId);
    const { region, place } = hit;
    const from = placeOf(run, region, time, place);
    this.held = { run, region, place, time, from, to: from, start: [x, y], last: [x, y], moved: false };
  }

  _move({ offsetX: x, offsetY: y, buttons, shiftKey }) {
    const { held } = this;
    if (!held && !buttons) this._hint(x, y);
    if (!held) return;
    held.moved ||= Math.hypot(x - held.start[0], y - held.start[1]) >= BEGINS;
    if (!held.moved) return;
    held.to = this._dragged(held, [x, y], shiftKey);
    held.last = [x, y];
    this.canvas.style.cursor = "grabbing";
    this._show(held);
  }

  /** Return the new position: on a level plane, vertical with `up`, or on the upright plane in an edge-on view. */
  _dragged({ last, from, to }, pixel, up) {
    const { camera } = this.link.page.scene();
    const upright = up || Math.abs(camera.forward[2]) < EDGE_ON;
    const level = [camera.forward[0], camera.forward[1], 0];
    if (upright && Vec.norm(level) < 1e-3) return to; // from straight above no upright plane is seen
    const normal = upright ? Vec.unit(level) : [0, 0, 1];
    const [a, b] = [last, pixel].map(([x, y]) => camera.placeOnPlane(x, y, to, normal));
    if (!a || !b) return to;
    const by = Vec.sub(b, a);
    const next = up ? [to[0], to[1], to[2] + by[2]] : upright ? Vec.add(to, by) : [to[0] + by[0], to[1] + by[1], to[2]];
    return Vec.distance(next, from) <= FARTHEST ? next : to;
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
    setTimeout(() => this.held ?? this._show(null), SETTLES);
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
