// Preview of a dragged region: outline, displacement and coordinates.

/** Preview canvas over the scene, without pointer events. */
class Ghost {
  /** @param {HTMLCanvasElement} canvas of the scene */
  constructor(canvas) {
    this.below = canvas;
    this.canvas = element("canvas", "region-ghost");
    this.canvas.setAttribute("aria-hidden", "true");
    canvas.after(this.canvas);
    this.context = this.canvas.getContext("2d");
  }

  clear() {
    this.context.clearRect(0, 0, this.canvas.width, this.canvas.height);
  }

  /** Draw a dragged region of a run at its new position. */
  draw(scene, { run, region, place, time, from, to }) {
    const { context } = this;
    const { clientWidth: width, clientHeight: height } = this.below;
    const ratio = window.devicePixelRatio || 1;
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
    }
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    const ink = getComputedStyle(this.below).getPropertyValue("--ink") || "#16222d";
    const card = getComputedStyle(this.below).getPropertyValue("--card") || "#ffffff";
    context.strokeStyle = context.fillStyle = ink;
    context.lineWidth = 2;

    context.setLineDash([6, 4]);
    const outline = this._outline(scene, run, region, time, place, Vec.sub(to, placeOf(run, region, time, place) ?? from));
    if (outline.length > 2) {
      this._path(outline);
      context.closePath();
      context.globalAlpha = 0.12;
      context.fill();
      context.globalAlpha = 1;
      context.stroke();
    }
    // first horizontally, then vertically
    const corner = [to[0], to[1], from[2]];
    context.lineWidth = 1.5;
    this._path([from, corner, to].map((place) => scene.project(place)));
    context.stroke();
    context.setLineDash([]);
    const [x, y] = scene.project(to);
    context.beginPath();
    context.arc(x, y, 3.5, 0, 2 * Math.PI);
    context.fill();
    this._label(to, x, y, width, ink, card);
  }

  _label([north, east, down], x, y, width, ink, card) {
    const { context } = this;
    const text = `N ${decimals(north, 2)}  E ${decimals(east, 2)}  D ${decimals(down, 2)} m`;
    context.font = "600 12px system-ui, sans-serif";
    const wide = context.measureText(text).width + 12;
    // on the side towards the middle of the canvas
    const left = Math.max(4, x > width / 2 ? x - wide - 12 : x + 12);
    const top = Math.max(4, y - 30);
    context.fillStyle = ink;
    context.beginPath();
    context.roundRect(left, top, wide, 20, 5);
    context.fill();
    context.fillStyle = card;
    context.textBaseline = "middle";
    context.fillText(text, left + 6, top + 10.5);
  }

  _path(points) {
    this.context.beginPath();
    points.forEach(([x, y], i) => (i ? this.context.lineTo(x, y) : this.context.moveTo(x, y)));
  }

  /** Return the outline [pixels] of a surface, moved by `by` [m, NED]; empty for a shape without a surface. */
  _outline(scene, run, region, time, place, by) {
    const shape = run.shape(region, time);
    const solid = surfaceOf(shape);
    if (!solid) return [];
    const shift = Vec.add(run.shift(region, time, place), by);
    const { points } = solid;
    const seen = [];
    for (let i = 0; i < points.length; i += 3) seen.push(scene.project([points[i] + shift[0], points[i + 1] + shift[1], points[i + 2] + shift[2]]));
    return convexRing(seen.filter(([x, y]) => Number.isFinite(x) && Number.isFinite(y)));
  }
}

/** Return the convex hull of points in a plane, after Andrew. */
function convexRing(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (list) => {
    const chain = [];
    for (const p of list) {
      while (chain.length > 1 && turn(chain.at(-2), chain.at(-1), p) <= 0) chain.pop();
      chain.push(p);
    }
    return chain.slice(0, -1);
  };
  const turn = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  return [...half(sorted), ...half(sorted.reverse())];
}
