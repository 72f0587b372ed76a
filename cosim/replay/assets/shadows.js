// Vertical shadows on the floor, as references for the depth.

/** Return the closed boundary lines [north, east] of a surface's upward faces, which hide what lies below. */
function shadowsOf({ points, faces, normals }) {
  const onward = new Map(); // boundary edges: those of upward faces whose other face is not upward
  for (const face of faces.filter((_, i) => normals[i][2] < -1e-9)) {
    face.forEach((a, k) => {
      const b = face[(k + 1) % face.length];
      if (!onward.get(b)?.delete(a)) onward.set(a, (onward.get(a) ?? new Set()).add(b));
    });
  }
  const lines = [];
  for (const [start, next] of onward) {
    while (next.size) {
      const line = [];
      for (let a = start; onward.get(a)?.size; ) {
        line.push(points[a].slice(0, 2));
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
function ellipseFromAbove(center, axes) {
  const sum = (i, j) => axes.reduce((total, axis) => total + axis[i] * axis[j], 0);
  const a = Math.sqrt(sum(0, 0));
  const b = sum(0, 1) / a;
  const c = Math.sqrt(Math.max(0, sum(1, 1) - b * b));
  return Array.from({ length: 48 }, (_, i) => {
    const [u, v] = [Math.cos((Math.PI * i) / 24), Math.sin((Math.PI * i) / 24)];
    return [center[0] + a * u, center[1] + b * u + c * v];
  });
}

/** Paint the shadows of surfaces, clipped to the bounds; keep-inside regions as outlines only. */
function paintShadows(painter, entries, bounds) {
  const floor = bounds[1][2];
  const trace = (filled) => {
    painter.begin();
    for (const { solid, shift } of entries.filter(({ solid, style }) => solid && style.filled === filled)) {
      for (const outline of solid.shadows) {
        const below = outline.map(([n, e]) => [n + shift[0], e + shift[1], floor]);
        painter.polygon(cutToBox(below, bounds, [0, 1]));
      }
    }
  };
  trace(true);
  painter.fill(COLORS.shadow);
  trace(false);
  painter.stroke(COLORS.soft, 1, 0.5, [4, 4]);
}

/** Paint the shadow of a vehicle, and the plumb line to it. */
function paintPlumb(painter, { pose: { position }, size }, floor) {
  const foot = [position[0], position[1], floor];
  painter.begin();
  painter.segment(position, foot);
  painter.stroke(COLORS.soft, 1, 0.9, [3, 3]);
  painter.begin();
  painter.polygon(Vec.circle(foot, [0, 0, 1], size, 36));
  painter.fill(COLORS.shadow);
  painter.stroke(COLORS.soft, 1, 0.6);
}

/** Paint the shadow of the past path, through the first points of its chunks. */
function paintWayBelow(painter, chunks, floor) {
  painter.begin();
  for (const { middle, past, next } of chunks) {
    if (past && next) painter.segment([middle[0], middle[1], floor], [next.middle[0], next.middle[1], floor]);
  }
  painter.stroke(COLORS.shadow, 2.5);
}
