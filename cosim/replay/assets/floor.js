// Reference marks of the scene: floor grid, depth ruler, water surface, compass and scale bar.

/** Return the least of 1, 2 or 5 times a power of ten that is not below `least`. */
function roundStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return power * [1, 2, 5, 10].find((k) => k * power >= least * (1 - 1e-9));
}

/** Return a length [m] as text, with the digits that a step needs. */
function metres(x, step) {
  const text = decimals(x, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
  return Number(text) === 0 ? "0" : text;
}

/** Return the multiples of a step within two bounds. */
function multiples(low, high, step) {
  const from = Math.ceil(low / step - 1e-6);
  const to = Math.floor(high / step + 1e-6);
  return Array.from({ length: Math.max(0, to - from + 1) }, (_, i) => (from + i) * step);
}

/** Return the grid spacing [m]: readable at the target, and not too many lines for the bounds. */
function gridStep(camera, [low, high]) {
  const readable = (64 * camera.distance) / camera.focal;
  const extent = Math.max(high[0] - low[0], high[1] - low[1]);
  return roundStep(Math.max(readable, extent / 60));
}

/** Paint the floor grid of the bounds, with coordinates [m] along the sides towards the eye. */
function paintFloor(painter, labels, bounds, colours, named) {
  const { camera } = painter;
  const [[n0, e0], [n1, e1, floor]] = bounds;
  const step = gridStep(camera, bounds);
  const [norths, easts] = [multiples(n0, n1, step), multiples(e0, e1, step)];
  painter.begin();
  painter.polygon([[n0, e0, floor], [n1, e0, floor], [n1, e1, floor], [n0, e1, floor]]);
  painter.fill(colours.floor);
  painter.begin();
  for (const n of norths) painter.segment([n, e0, floor], [n, e1, floor]);
  for (const e of easts) painter.segment([n0, e, floor], [n1, e, floor]);
  painter.stroke(colours.grid, 1);
  painter.begin();
  painter.line([[n0, e0, floor], [n1, e0, floor], [n1, e1, floor], [n0, e1, floor], [n0, e0, floor]]);
  painter.stroke(colours.gridMajor, 1.2);
  if (!named) return;
  // the side nearer to the eye, unless fewer than two of its labels are in the picture
  const seen = (p) => {
    const [x, y, depth] = camera.project(p);
    return depth > camera.near && x > 0 && y > 0 && x < camera.width && y < camera.height;
  };
  const edge = (ticks, at, low, high) => {
    const sides = [[low, -1], [high, 1]].map(([side, sign]) => {
      const [x, y, depth] = camera.project(at(0.5 * (ticks[0] + ticks.at(-1)), side));
      return { side, sign, x, y, depth, shown: ticks.filter((tick) => seen(at(tick, side))) };
    });
    sides.sort((a, b) => (Math.abs(a.y - b.y) > 1 ? b.y - a.y : a.depth - b.depth));
    return sides.find(({ shown }) => shown.length > 1) ?? sides[0];
  };
  const name = (key, at, outward, text, rank) => {
    const p = camera.project(at);
    const q = camera.project(Vec.add(at, outward));
    if (p[2] < camera.near || q[2] < camera.near) return;
    const length = Math.hypot(q[0] - p[0], q[1] - p[1]) || 1;
    const off = rank > 40 ? 13 : 32;
    const x = p[0] + (off * (q[0] - p[0])) / length;
    const y = p[1] + (off * (q[1] - p[1])) / length + (length < 2 ? off : 0);
    labels.add({ key, text, x, y, colour: colours.soft, size: 11, rank, gap: 0, pad: 7, sides: ["here"] });
  };
  const out = 0.02 * camera.distance;
  const axes = [
    ["north", norths, e0, e1, (n, e) => [n, e, floor], [0, out, 0]],
    ["east", easts, n0, n1, (e, n) => [n, e, floor], [out, 0, 0]],
  ];
  for (const [axis, ticks, low, high, at, outward] of axes) {
    if (!ticks.length) continue;
    const { side, sign, shown } = edge(ticks, at, low, high);
    const away = Vec.scale(outward, sign);
    for (const tick of shown) name(`${axis} ${tick}`, at(tick, side), away, metres(tick, step), 60);
    const [first, last] = [shown[0] ?? ticks[0], shown.at(-1) ?? ticks.at(-1)];
    name(axis, at(0.5 * (first + last), side), away, `${axis} [m]`, 40);
  }
}

/** Paint a depth ruler on the leftmost vertical edge of the bounds. */
function paintRuler(painter, labels, bounds, colours, named) {
  const { camera } = painter;
  const [low, high] = bounds;
  const corners = [low, high].flatMap(([n]) => [low, high].map(([, e]) => [n, e]));
  const seen = corners.map(([n, e]) => [n, e, camera.project([n, e, high[2]])]);
  const feet = seen.filter((foot) => foot[2][2] > camera.near);
  if (!feet.length) return;
  const [n, e, foot] = feet.reduce((a, b) => (b[2][0] < a[2][0] ? b : a));
  const head = camera.project([n, e, low[2]]);
  const pixels = Math.hypot(head[0] - foot[0], head[1] - foot[1]);
  if (head[2] < camera.near || pixels < 40) return;
  const step = roundStep(((high[2] - low[2]) * 34) / pixels);
  painter.begin();
  painter.segment([n, e, low[2]], [n, e, high[2]]);
  painter.stroke(colours.gridMajor, 1.2);
  painter.context.beginPath();
  for (const depth of multiples(low[2], high[2], step)) {
    const [x, y] = camera.project([n, e, depth]);
    painter.context.moveTo(x, y);
    painter.context.lineTo(x - 5, y);
    const word = { colour: colours.soft, size: 11, x, y, gap: 9, sides: ["left"] };
    if (named) labels.add({ ...word, key: `d${depth}`, text: metres(depth, step), rank: 50 });
  }
  painter.stroke(colours.gridMajor, 1.2);
  const title = { key: "depth", text: "depth [m]", colour: colours.soft, size: 11, rank: 40 };
  if (named) labels.add({ ...title, x: head[0], y: head[1], gap: 9, sides: ["above"] });
}

/** Paint the outline of the water surface if the bounds reach up to it. */
function paintSurface(painter, bounds, colours) {
  const [[n0, e0, top], [n1, e1]] = bounds;
  if (top > 0) return;
  painter.begin();
  painter.line([[n0, e0, 0], [n1, e0, 0], [n1, e1, 0], [n0, e1, 0], [n0, e0, 0]]);
  painter.stroke(colours.gridMajor, 1, 0.9, [2, 4]);
}

/** Paint the directions north, east and down in a corner. */
function paintCompass(painter, labels, colours) {
  const { context, camera } = painter;
  const [x, y, size] = [46, camera.height - 46, 26];
  const axes = [["N", [1, 0, 0]], ["E", [0, 1, 0]], ["D", [0, 0, 1]]];
  const placed = [];
  context.lineCap = "round";
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.font = "600 11px system-ui, sans-serif";
  for (const [name, axis] of axes) {
    const [dx, dy] = [size * Vec.dot(axis, camera.right), -size * Vec.dot(axis, camera.up)];
    const colour = name === "N" ? colours.ink : colours.soft;
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(x + dx, y + dy);
    painter.stroke(colour, name === "N" ? 2.6 : 1.8);
    const length = Math.hypot(dx, dy);
    const [u, v] = [x + (dx * (length + 9)) / length, y + (dy * (length + 9)) / length];
    if (length < 8 || placed.some(([p, q]) => Math.hypot(p - u, q - v) < 13)) continue;
    placed.push([u, v]);
    context.fillStyle = colour;
    context.fillText(name, u, v);
  }
  context.lineCap = "butt";
  labels.block(x - 40, y - 40, 80, 80);
}

/** Paint a scale bar for lengths at the target, and the magnification of the vehicle. */
function paintScale(painter, labels, colours, magnified) {
  const { context, camera } = painter;
  const pixels = camera.focal / camera.distance;
  const length = roundStep(60 / pixels) > 110 / pixels ? roundStep(30 / pixels) : roundStep(60 / pixels);
  const [x, y] = [camera.width - 16 - length * pixels, camera.height - 18];
  context.beginPath();
  context.moveTo(x, y - 4);
  context.lineTo(x, y);
  context.lineTo(x + length * pixels, y);
  context.lineTo(x + length * pixels, y - 4);
  painter.stroke(colours.ink, 1.5);
  const text = `${length < 1000 ? length : length / 1000} ${length < 1000 ? "m" : "km"}`;
  const size = magnified > 1.05 ? ` · vehicle ×${magnified.toPrecision(2)}` : "";
  context.font = "11px system-ui, sans-serif";
  context.textAlign = "right";
  context.textBaseline = "bottom";
  context.fillStyle = colours.ink;
  context.fillText(text + size, camera.width - 16, y - 6);
  labels.block(Math.min(x, camera.width - 150) - 6, y - 22, 180, 40);
}
