// Unbounded regions (depth bands and half spaces), as the parts of their planes within the scene's bounds.

/**
 * Part of a plane.
 * @typedef {object} Sheet
 * @property {number[][]} corners [m, NED]
 * @property {number[]} normal unit vector towards the forbidden side
 * @property {number[][][]} hatch pairs of points: strokes along the rim, on the forbidden side
 */

/** Return the parts of a region's planes within bounds [lowest corner, highest corner]; a plane outside has none. */
function sheetsOf(shape, keep, shift, bounds) {
  const sign = keep === "in" ? 1 : -1;
  return shape.drawing.planes.flatMap(({ point, normal }) => {
    const corners = cutOfBounds(Vec.add(point, shift), normal, bounds);
    if (corners.length < 3) return [];
    const forbidden = Vec.scale(normal, sign);
    return [{ corners, normal: forbidden, hatch: hatchOf(corners, forbidden) }];
  });
}

/** Return the polygon in which a plane cuts an axis-aligned box; empty if it does not cut the box. */
function cutOfBounds(point, normal, [low, high]) {
  // a square that is larger than the box, clipped by the six sides of the box
  const centre = low.map((x, i) => 0.5 * (x + high[i]));
  const size = Vec.norm(Vec.sub(high, low));
  const middle = Vec.along(centre, normal, Vec.dot(Vec.sub(point, centre), normal));
  const [a, b] = Vec.aside(normal);
  let polygon = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([u, v]) =>
    Vec.along(Vec.along(middle, a, u * size), b, v * size),
  );
  for (let axis = 0; axis < 3; axis++) {
    polygon = cutPolygon(polygon, (p) => p[axis] - low[axis]);
    polygon = cutPolygon(polygon, (p) => high[axis] - p[axis]);
  }
  return polygon;
}

/** Clip a polygon to where a linear function is at least 0. */
function cutPolygon(polygon, inside) {
  const kept = [];
  polygon.forEach((a, i) => {
    const b = polygon[(i + 1) % polygon.length];
    const [at, next] = [inside(a), inside(b)];
    if (at >= 0) kept.push(a);
    if (at >= 0 !== next >= 0) kept.push(Vec.along(a, Vec.sub(b, a), at / (at - next)));
  });
  return kept;
}

/** Return short oblique strokes from the rim to the forbidden side, as drawings mark the side of the material. */
function hatchOf(corners, forbidden) {
  const around = corners.map((a, i) => Vec.norm(Vec.sub(corners[(i + 1) % corners.length], a)));
  const length = around.reduce((sum, x) => sum + x, 0);
  const step = length / Math.max(40, Math.min(160, Math.round(length / 0.25)));
  const strokes = [];
  corners.forEach((a, i) => {
    if (around[i] < 0.5 * step) return;
    const way = Vec.scale(Vec.sub(corners[(i + 1) % corners.length], a), 1 / around[i]);
    for (let at = 0.5 * step; at < around[i]; at += step) {
      const from = Vec.along(a, way, at);
      strokes.push([from, Vec.along(Vec.along(from, way, -0.55 * step), forbidden, 0.75 * step)]);
    }
  });
  return strokes;
}
