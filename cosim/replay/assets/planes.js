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
  return shape.drawing.planes.flatMap(({ point, normal }) => {
    const corners = cutOfBounds(Vec.add(point, shift), normal, bounds);
    const forbidden = Vec.scale(normal, keep === "in" ? 1 : -1);
    return corners.length < 3 ? [] : [{ corners, normal: forbidden, hatch: hatchOf(corners, forbidden) }];
  });
}

/** Return the polygon in which a plane cuts an axis-aligned box; empty if it does not cut the box. */
function cutOfBounds(point, normal, bounds) {
  // a square that is larger than the box, clipped by the six sides of the box
  const center = Vec.mean(bounds);
  const size = Vec.distance(...bounds);
  const middle = Vec.along(center, normal, Vec.dot(Vec.sub(point, center), normal));
  const [a, b] = Vec.aside(normal);
  const square = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([u, v]) =>
    Vec.along(Vec.along(middle, a, u * size), b, v * size));
  return cutToBox(square, bounds, [0, 1, 2]);
}

/** Return short oblique strokes from the rim to the forbidden side, as drawings mark the side of the material. */
function hatchOf(corners, forbidden) {
  const sides = corners.map((a, i) => [a, Vec.sub(corners[(i + 1) % corners.length], a)]);
  const around = sides.reduce((sum, [, side]) => sum + Vec.norm(side), 0);
  const step = around / clamp(Math.round(around / 0.25), 40, 160);
  return sides.flatMap(([a, side]) => {
    const count = Math.max(0, Math.ceil(Vec.norm(side) / step - 0.5));
    return Array.from({ length: count }, (_, k) => {
      const along = Vec.unit(side);
      const from = Vec.along(a, along, (k + 0.5) * step);
      return [from, Vec.along(Vec.along(from, along, -0.55 * step), forbidden, 0.75 * step)];
    });
  });
}
