// Preview of a dragged region: outline, displacement and coordinates.

/** Preview canvas over the scene, without pointer events. */
class Ghost {
  /** @param {HTMLCanvasElement} canvas of the scene */
  constructor(canvas) {
    this.canvas = h("canvas.region-ghost", { ariaHidden: true });
    canvas.after(this.canvas);
  }

  clear() { clearedCanvas(this.canvas); }

  /** Draw a dragged region of a run at its new position. */
  draw(scene, { run, region, place, time, from, to }) {
    const { context, width } = clearedCanvas(this.canvas);
    Object.assign(context, { strokeStyle: COLOURS.ink, fillStyle: COLOURS.ink, lineWidth: 2 });
    context.setLineDash([6, 4]);
    const by = Vec.sub(to, placeOf(run, region, time, place) ?? from);
    const shift = Vec.add(run.shift(region, time, place), by);
    const points = surfaceOf(run.shape(region, time))?.points ?? [];
    const outline = convexRing(points.map((p) => scene.project(Vec.add(p, shift))).filter(Vec.finite));
    if (outline.length > 2) {
      beginLines(context, outline);
      context.closePath();
      context.globalAlpha = 0.12;
      context.fill();
      context.globalAlpha = 1;
      context.stroke();
    }
    // first horizontally, then vertically
    beginLines(context, [from, [to[0], to[1], from[2]], to].map((p) => scene.project(p)));
    context.lineWidth = 1.5;
    context.stroke();
    const [x, y] = scene.project(to);
    context.beginPath();
    context.arc(x, y, 3.5, 0, 2 * Math.PI);
    context.fill();
    const [north, east, down] = to.map((coordinate) => decimals(coordinate, 2));
    const text = `N ${north}  E ${east}  D ${down} m`;
    context.font = "600 12px system-ui, sans-serif";
    const wide = context.measureText(text).width + 12;
    // on the side towards the middle of the canvas
    const left = Math.max(4, x > width / 2 ? x - wide - 12 : x + 12);
    const top = Math.max(4, y - 30);
    fillRounded(context, COLOURS.ink, left, top, wide, 20, 5);
    writeText(context, text, left + 6, top + 10.5, { fillStyle: COLOURS.card, textBaseline: "middle" });
  }
}

/** Return the convex hull of points in a plane, after Andrew. */
function convexRing(points) {
  const turn = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  const half = (list) => list.reduce((chain, p) => {
    while (chain.length > 1 && turn(chain.at(-2), chain.at(-1), p) <= 0) chain.pop();
    return [...chain, p];
  }, []).slice(0, -1);
  const sorted = points.toSorted((a, b) => a[0] - b[0] || a[1] - b[1]);
  return [...half(sorted), ...half(sorted.toReversed())];
}
