// Vertical shadows on the floor, as references for the depth.

/** Return the closed boundary lines [north, east] of a surface's upward faces, which hide what lies below. */
function shadowsOf({ points, faces, normals }) {
  const up = faces.map((_, i) => normals[3 * i + 2] < -1e-9);
  const onward = new Map(); // boundary edges: those of upward faces whose other face is not upward
  faces.forEach((face, i) => {
    if (!up[i]) return;
    face.forEach((a, k) => {
      const b = face[(k + 1) % face.length];
      if (onward.get(b)?.delete(a)) return;
      onward.set(a, (onward.get(a) ?? new Set()).add(b));
    });
  });
  const lines = [];
  for (const [start, next] of onward) {
    while (next.size) {
      const line = [];
      for (let a = start; onward.get(a)?.size; ) {
        line.push([points[3 * a], points[3 * a + 1]]);
        const [b] = onward.get(a);
        onward.get(a).delete(b);
        a = b;
      }
      lines.push(line.reverse()); // oriented like an ellipse, so that overlapping shadows add up
    }
  }
  return lines;
}

/** Return the outline of an ellipsoid from above: the unit circle times a root of the sum of squared half axes. */
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

/** Return a shifted outline on the floor, clipped to the bounds. */
function onFloor(outline, shift, [low, high]) {
  let polygon = outline.map(([n, e]) => [n + shift[0], e + shift[1], high[2]]);
  for (let axis = 0; axis < 2; axis++) {
    polygon = cutPolygon(polygon, (p) => p[axis] - low[axis]);
    polygon = cutPolygon(polygon, (p) => high[axis] - p[axis]);
  }
  return polygon;
}

/** Paint the shadows of surfaces; keep-inside regions as outlines only. */
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

/** Paint the shadow of a vehicle, and the plumb line to it. */
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

/** Paint the shadow of the past path, through the first points of its chunks. */
function paintWayBelow(painter, chunks, floor, colours) {
  painter.begin();
  for (const { middle, past, next } of chunks) {
    if (past && next) painter.segment([middle[0], middle[1], floor], [next.middle[0], next.middle[1], floor]);
  }
  painter.stroke(colours.shadow, 2.5);
}
