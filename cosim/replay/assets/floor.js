// Reference marks of the scene: floor grid, depth ruler, water surface, compass and scale bar.

/** Return a length [m] as text, with the digits that a step needs. */
function meters(x, step) {
  const text = decimals(x, digitsOf(step));
  return Number(text) === 0 ? "0" : text;
}

/** Return the grid spacing [m]: readable at the target, and not too many lines for the bounds. */
function gridStep(camera, [low, high]) {
  const readable = (64 * camera.distance) / camera.focal;
  return roundStep(Math.max(readable, Math.max(high[0] - low[0], high[1] - low[1]) / 60));
}

/** Return the corners of the bounds at a depth. */
const levelCorners = ([[n0, e0], [n1, e1]], depth) =>
  [[n0, e0, depth], [n1, e0, depth], [n1, e1, depth], [n0, e1, depth]];

/** Paint the floor grid of the bounds, with coordinates [m] along the sides towards the eye. */
function paintFloor(painter, labels, bounds, named) {
  const { camera } = painter;
  const [[n0, e0], [n1, e1, floor]] = bounds;
  const step = gridStep(camera, bounds);
  const [norths, easts] = [multiples(n0, n1, step), multiples(e0, e1, step)];
  painter.begin();
  painter.polygon(levelCorners(bounds, floor));
  painter.fill(COLORS.floor);
  painter.begin();
  for (const n of norths) painter.segment([n, e0, floor], [n, e1, floor]);
  for (const e of easts) painter.segment([n0, e, floor], [n1, e, floor]);
  painter.stroke(COLORS.gridMinor, 1);
  painter.begin();
  painter.polygon(levelCorners(bounds, floor));
  painter.stroke(COLORS.gridMajor, 1.2);
  if (!named) return;
  // the side nearer to the eye, unless fewer than two of its labels are in the picture
  const nearSide = (ticks, at, low, high) => {
    const sides = [[low, -1], [high, 1]].map(([side, sign]) => {
      const [, y, depth] = camera.project(at(0.5 * (ticks[0] + ticks.at(-1)), side));
      const shown = ticks.filter((tick) => camera.isInPicture(camera.project(at(tick, side))));
      return { side, sign, y, depth, shown };
    });
    sides.sort((a, b) => (Math.abs(a.y - b.y) > 1 ? b.y - a.y : a.depth - b.depth));
    return sides.find(({ shown }) => shown.length > 1) ?? sides[0];
  };
  const name = (key, at, outward, text, rank, off) => {
    const [p, q] = [at, Vec.add(at, outward)].map((point) => camera.project(point));
    if (Math.min(p[2], q[2]) < camera.near) return;
    const length = Math.hypot(q[0] - p[0], q[1] - p[1]) || 1;
    const x = p[0] + (off * (q[0] - p[0])) / length;
    const y = p[1] + (off * (q[1] - p[1])) / length + (length < 2 ? off : 0);
    labels.add({ key, text, x, y, color: COLORS.soft, size: 11, rank, gap: 0, pad: 7, sides: ["here"] });
  };
  const out = 0.02 * camera.distance;
  const axes = [
    ["north", norths, e0, e1, (n, e) => [n, e, floor], [0, out, 0]],
    ["east", easts, n0, n1, (e, n) => [n, e, floor], [out, 0, 0]],
  ];
  for (const [axis, ticks, low, high, at, outward] of axes.filter(([, list]) => list.length)) {
    const { side, sign, shown } = nearSide(ticks, at, low, high);
    const away = Vec.scale(outward, sign);
    for (const tick of shown) name(`${axis} ${tick}`, at(tick, side), away, meters(tick, step), 60, 13);
    const [first, last] = [shown[0] ?? ticks[0], shown.at(-1) ?? ticks.at(-1)];
    name(axis, at(0.5 * (first + last), side), away, `${axis} [m]`, 40, 32);
  }
}

/** Paint a depth ruler on the leftmost vertical edge of the bounds. */
function paintRuler(painter, labels, bounds, named) {
  const { camera } = painter;
  const [top, floor] = bounds.map((corner) => corner[2]);
  const feet = levelCorners(bounds, floor).map((at) => ({ at, pixel: camera.project(at) }));
  const seen = feet.filter(({ pixel }) => pixel[2] > camera.near);
  if (!seen.length) return;
  const { at: [n, e], pixel: foot } = seen.reduce((a, b) => (b.pixel[0] < a.pixel[0] ? b : a));
  const head = camera.project([n, e, top]);
  const pixels = Math.hypot(head[0] - foot[0], head[1] - foot[1]);
  if (head[2] < camera.near || pixels < 40) return;
  const step = roundStep(((floor - top) * 34) / pixels);
  painter.begin();
  painter.segment([n, e, top], [n, e, floor]);
  painter.stroke(COLORS.gridMajor, 1.2);
  const word = { color: COLORS.soft, size: 11, gap: 9 };
  const ticks = multiples(top, floor, step).map((depth) => ({ depth, pixel: camera.project([n, e, depth]) }));
  painter.strokeLines(ticks.map(({ pixel: [x, y] }) => [[x, y], [x - 5, y]]), COLORS.gridMajor, 1.2);
  if (!named) return;
  for (const { depth, pixel: [x, y] } of ticks) {
    labels.add({ ...word, x, y, key: `d${depth}`, text: meters(depth, step), rank: 50, sides: ["left"] });
  }
  labels.add({ ...word, x: head[0], y: head[1], key: "depth", text: "depth [m]", rank: 40, sides: ["above"] });
}

/** Paint the outline of the water surface if the bounds reach up to it. */
function paintSurface(painter, bounds) {
  if (bounds[0][2] > 0) return;
  painter.begin();
  painter.polygon(levelCorners(bounds, 0));
  painter.stroke(COLORS.gridMajor, 1, 0.9, [2, 4]);
}

/** Paint the directions north, east and down in a corner. */
function paintCompass(painter, labels) {
  const { context, camera } = painter;
  const [x, y, size] = [46, camera.height - 46, 26];
  const placed = [];
  Object.assign(context, { lineCap: "round", textAlign: "center", textBaseline: "middle" });
  [..."NED"].forEach((name, i) => {
    const [dx, dy] = [size * camera.right[i], -size * camera.up[i]];
    const fillStyle = name === "N" ? COLORS.ink : COLORS.soft;
    painter.strokeLines([[[x, y], [x + dx, y + dy]]], fillStyle, name === "N" ? 2.6 : 1.8);
    const length = Math.hypot(dx, dy);
    const [u, v] = [x + (dx * (length + 9)) / length, y + (dy * (length + 9)) / length];
    if (length < 8 || placed.some(([p, q]) => Math.hypot(p - u, q - v) < 13)) return;
    placed.push([u, v]);
    writeText(context, name, u, v, { fillStyle, font: "600 11px system-ui, sans-serif" });
  });
  context.lineCap = "butt";
  labels.block(x - 40, y - 40, 80, 80);
}

/** Paint a scale bar for lengths at the target, and the magnification of the vehicle. */
function paintScale(painter, labels, magnified) {
  const { context, camera } = painter;
  const pixels = camera.focal / camera.distance;
  const length = roundStep(60 / pixels) > 110 / pixels ? roundStep(30 / pixels) : roundStep(60 / pixels);
  const [left, right, y] = [camera.width - 16 - length * pixels, camera.width - 16, camera.height - 18];
  painter.strokeLines([[[left, y - 4], [left, y], [right, y], [right, y - 4]]], COLORS.ink, 1.5);
  const text = length < 1000 ? `${length} m` : `${length / 1000} km`;
  const size = magnified > 1.05 ? ` · vehicle ×${magnified.toPrecision(2)}` : "";
  const style = { font: FONT, textAlign: "right", textBaseline: "bottom", fillStyle: COLORS.ink };
  writeText(context, text + size, right, y - 6, style);
  labels.block(Math.min(left, camera.width - 150) - 6, y - 22, 180, 40);
}
