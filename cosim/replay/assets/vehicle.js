// Drawing of the vehicle: shaded hull and body axes.

/** Return a color of the hull in one of eight steps of light. */
function shaded(color, light) {
  const part = Math.round(7 * clamp(light, 0, 1)) / 7;
  const [to, most] = part < 0.6 ? ["#0a141b", 1.1] : ["#ffffff", 0.5];
  return mixedColor(color, to, most * Math.abs(part - 0.6));
}

/** Return the hull's faces towards the eye, in the world frame: [{corners, middle, color}]. */
function hullAt(vehicle, { position, R }, size, eye) {
  const world = (p) => Vec.along(position, Vec.turned(R, p), size);
  return hullOf(vehicle).flatMap(({ color, corners, middle, normal }) => {
    const [outward, place] = [Vec.turned(R, normal), world(middle)];
    if (Vec.dot(outward, Vec.sub(eye, place)) <= 0) return [];
    const light = 0.5 - 0.42 * outward[2] + 0.1 * outward[0] - 0.06 * outward[1]; // from above and oblique
    return [{ corners: corners.map(world), middle: place, color: shaded(COLORS[color], light) }];
  });
}

/** Return the body's axes (forward, starboard, down) as lines out of the hull: [{line, name, middle, width}]. */
function bodyAxes({ position, R }, size) {
  return [["x", 0.98, 2.3, 2.2], ["y", 0.7, 1.8, 1.2], ["z", 0.7, 1.7, 1.2]].map(([name, from, to, width], i) => {
    const [start, middle, end] = [from, 0.8 * to, to].map((off) =>
      Vec.along(position, [R[i], R[3 + i], R[6 + i]], off * size));
    return { line: [start, end], name, middle, width };
  });
}

/** Draw one of the body's axes, with its name if the line is long enough. */
function paintBodyAxis(painter, { line, name, width }) {
  const { context, camera } = painter;
  painter.begin();
  painter.segment(...line);
  painter.stroke(COLORS.ink, width, 0.8);
  const [[x, y, near], [u, v, depth]] = line.map((p) => camera.project(p));
  const length = Math.hypot(u - x, v - y);
  if (Math.min(near, depth) < camera.near || length < 14) return;
  const font = "italic 11px system-ui, sans-serif";
  const style = { fillStyle: COLORS.ink, font, textAlign: "center", textBaseline: "middle" };
  writeText(context, name, u + (8 * (u - x)) / length, v + (8 * (v - y)) / length, style);
}
