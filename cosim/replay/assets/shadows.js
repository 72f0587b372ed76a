// Shadows straight down on the floor, from which depth can be read.

/** The outline of points seen from above: their convex hull, after Andrew. */
function outlineFromAbove(points) {
  const flat = points.map(([n, e]) => [n, e]).sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const left = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 1e-12;
  const half = (sorted) => {
    const chain = [];
    for (const p of sorted) {
      while (chain.length > 1 && !left(chain[chain.length - 2], chain[chain.length - 1], p)) chain.pop();
      chain.push(p);
    }
    return chain.slice(0, -1);
  };
  return [...half(flat), ...half([...flat].reverse())];
}

/** The outline of an ellipsoid seen from above: the unit circle through a root of its squared half axes. */
function ellipseFromAbove(centre, axes) {
  const sum = (i, j) => axes.reduce((total, axis) => total + axis[i] * axis[j], 0);
  const a = Math.sqrt(sum(0, 0));
  const b = sum(0, 1) / a;
  const c = Math.sqrt(Math.max(0, sum(1, 1) - b * b));
  return Array.from({ length: 48 }, (_, i) => {
    const [u, v] = [Math.cos((Math.PI * i) / 24), Math.sin((Math.PI * i) / 24)];
    return [centre[0] + a * u, centre[1] + b * u + c * v];
  });
}

/** An outline, seen from above and shifted, on the floor of bounds, as far as that goes. */
function onFloor(outline, shift, [low, high]) {
  let polygon = outline.map(([n, e]) => [n + shift[0], e + shift[1], high[2]]);
  for (let axis = 0; axis < 2; axis++) {
    polygon = cutPolygon(polygon, (p) => p[axis] - low[axis]);
    polygon = cutPolygon(polygon, (p) => high[axis] - p[axis]);
  }
  return polygon;
}

/** Shadows of surfaces, those that are kept in as outlines only. */
function paintShadows(painter, entries, bounds, colours) {
  const add = ({ solid, shift }) => {
    for (const outline of solid.shadows) painter.polygon(onFloor(outline, shift, bounds));
  };
  const surfaces = entries.filter((entry) => entry.solid);
  painter.begin();
  surfaces.filter((entry) => entry.style.filled).forEach(add);
  painter.fill(colours.shadow);
  painter.begin();
  surfaces.filter((entry) => !entry.style.filled).forEach(add);
  painter.stroke(colours.soft, 1, 0.5, [4, 4]);
}

/** The shadow of a vehicle, and the plumb line to it. */
function paintPlumb(painter, { pose, size }, floor, colours) {
  const [n, e] = pose.position;
  const foot = [n, e, floor];
  painter.begin();
  painter.segment(pose.position, foot);
  painter.stroke(colours.soft, 1, 0.9, [3, 3]);
  painter.begin();
  painter.polygon(rimOf(foot, [0, 0, 1], 0.5 * Math.PI, size));
  painter.fill(colours.shadow);
  painter.stroke(colours.soft, 1, 0.6);
}

/** The shadow of the way so far, through the beginnings of its chunks. */
function paintWayBelow(painter, chunks, floor, colours) {
  painter.begin();
  for (const { middle, past, next } of chunks) {
    if (past && next) painter.segment([middle[0], middle[1], floor], [next.middle[0], next.middle[1], floor]);
  }
  painter.stroke(colours.shadow, 2.5);
}
