// Drawing of the vehicle: shaded hull and body axes.

const SHADES = new Map();

/** Return a color of the hull in one of eight steps of light. */
function shaded(colour, light) {
  const step = Math.round(7 * Math.min(1, Math.max(0, light)));
  const key = `${colour} ${step}`;
  if (!SHADES.has(key)) {
    const part = step / 7;
    const [to, most] = part < 0.6 ? ["#0a141b", 1.1] : ["#ffffff", 0.5];
    SHADES.set(key, mixedColour(colour, to, most * Math.abs(part - 0.6)));
  }
  return SHADES.get(key);
}

/** Return the hull's faces towards the eye, in the world frame: [{corners, middle, colour}]. */
function hullAt(vehicle, { position, R }, size, eye, theme) {
  const seen = [];
  const view = Vec.scale(Vec.sub(eye, position), 1 / size);
  // position of the eye in body axes, for a hull of radius 1
  const [x, y, z] = [0, 1, 2].map((i) => R[i] * view[0] + R[3 + i] * view[1] + R[6 + i] * view[2]);
  for (const { colour, corners, middle, normal } of hullOf(vehicle)) {
    if (normal[0] * (x - middle[0]) + normal[1] * (y - middle[1]) + normal[2] * (z - middle[2]) <= 0) continue;
    const turned = Vec.turned(R, normal);
    const light = 0.5 - 0.42 * turned[2] + 0.1 * turned[0] - 0.06 * turned[1]; // from above and oblique
    seen.push({
      corners: corners.map((p) => Vec.along(position, Vec.turned(R, p), size)),
      middle: Vec.along(position, Vec.turned(R, middle), size),
      colour: shaded(SCENE_THEMES[theme].hull[colour], light),
    });
  }
  return seen;
}

/** Return the body's axes (forward, starboard, down) as lines out of the hull: [{line, name, middle, width}]. */
function bodyAxes({ position, R }, size) {
  return [["x", 2.3], ["y", 1.8], ["z", 1.7]].map(([name, length], i) => {
    const axis = [R[i], R[3 + i], R[6 + i]];
    const line = [Vec.along(position, axis, (i ? 0.7 : 0.98) * size), Vec.along(position, axis, length * size)];
    return { line, name, middle: Vec.along(position, axis, 0.8 * length * size), width: i ? 1.2 : 2.2 };
  });
}

/** Draw one of the body's axes, with its name if the line is long enough. */
function paintBodyAxis(painter, { line, name, width }, colour) {
  const { context, camera } = painter;
  painter.begin();
  painter.segment(...line);
  painter.stroke(colour, width, 0.8);
  const [[x, y, near], [u, v, depth]] = line.map((p) => camera.project(p));
  const length = Math.hypot(u - x, v - y);
  if (Math.min(near, depth) < camera.near || length < 14) return;
  context.fillStyle = colour;
  context.font = "italic 11px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillText(name, u + (8 * (u - x)) / length, v + (8 * (v - y)) / length);
}
