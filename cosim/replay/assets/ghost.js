// Preview of a dragged region in the scene: outline, displacement and coordinates.

/** Paint a dragged region of a run at its new position; `ghost` as Dragging holds it. */
function paintGhost({ context, camera }, { run, region, place, time, from, to }) {
  const pixels = (points) => points.map((p) => camera.project(p)).filter(([x, y]) => Number.isFinite(x + y));
  const by = Vec.sub(to, placeOf(run, region, time, place) ?? from);
  const shift = Vec.add(run.shift(region, time, place), by);
  const points = surfaceOf(run.shape(region, time))?.points ?? [];
  const outline = convexRing(pixels(points.map((p) => Vec.add(p, shift))));
  Object.assign(context, { strokeStyle: COLORS.ink, fillStyle: COLORS.ink, lineWidth: 2 });
  context.setLineDash([6, 4]);
  beginLines(context, outline);
  context.closePath();
  context.globalAlpha = 0.12;
  context.fill();
  context.globalAlpha = 1;
  context.stroke();
  // first horizontally, then vertically
  beginLines(context, pixels([from, [to[0], to[1], from[2]], to]));
  context.lineWidth = 1.5;
  context.stroke();
  context.setLineDash([]);
  const [x, y] = camera.project(to);
  context.beginPath();
  context.arc(x, y, 3.5, 0, 2 * Math.PI);
  context.fill();
  const [north, east, down] = to.map((coordinate) => decimals(coordinate, 2));
  const text = `N ${north}  E ${east}  D ${down} m`;
  context.font = "600 12px system-ui, sans-serif";
  const width = context.measureText(text).width + 12;
  // on the side towards the middle of the picture
  const left = Math.max(4, x > camera.width / 2 ? x - width - 12 : x + 12);
  const top = Math.max(4, y - 30);
  fillRounded(context, COLORS.ink, left, top, width, 20, 5);
  writeText(context, text, left + 6, top + 10.5, { fillStyle: COLORS.card, textAlign: "left", textBaseline: "middle" });
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
