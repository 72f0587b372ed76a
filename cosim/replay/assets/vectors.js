// Vectors of three numbers, and rotation matrices of quaternions, scalar first.

const clamp = (x, low, high) => Math.min(high, Math.max(low, x));

const Vec = {
  add: (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]],
  sub: (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]],
  scale: (a, k) => [k * a[0], k * a[1], k * a[2]],
  /** Return a + k b. */
  along: (a, b, k) => [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]],
  dot: (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2],
  cross: (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]],
  norm: (a) => Math.hypot(a[0], a[1], a[2]),
  unit: (a) => Vec.scale(a, 1 / Vec.norm(a)),
  distance: (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]),
  finite: (a) => a.every(Number.isFinite),
  mean: (points) => points.reduce((sum, p) => Vec.along(sum, p, 1 / points.length), [0, 0, 0]),

  /** Return the rotation matrix, row by row, of a quaternion of any length. */
  matrix(quaternion) {
    const length = Math.hypot(...quaternion);
    const [w, x, y, z] = quaternion.map((e) => e / length);
    return [
      1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
      2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
      2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    ];
  },

  /** Return R v for a matrix R, row by row. */
  turned: (R, v) => [
    R[0] * v[0] + R[1] * v[1] + R[2] * v[2],
    R[3] * v[0] + R[4] * v[1] + R[5] * v[2],
    R[6] * v[0] + R[7] * v[1] + R[8] * v[2],
  ],

  /** Return two unit vectors at right angles to a unit vector and to each other; the three are right-handed. */
  aside(axis) {
    // not parallel to the axis, to avoid cancellation; along the world's axes if possible
    const first = Vec.unit(Vec.cross(Math.abs(axis[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0], axis));
    return [first, Vec.cross(axis, first)];
  },

  /** Return `count` points of a circle about an axis; the first is turned by `phase` of their spacing. */
  circle(center, axis, radius, count, phase = 0) {
    const [first, second] = Vec.aside(axis);
    return Array.from({ length: count }, (_, i) => {
      const angle = (2 * Math.PI * (i + phase)) / count;
      return Vec.along(Vec.along(center, first, radius * Math.cos(angle)), second, radius * Math.sin(angle));
    });
  },
};

/** Return the axis-aligned box [low, high] of some points. */
const boxAbout = (points) =>
  [Math.min, Math.max].map((f) => [0, 1, 2].map((i) => points.reduce((x, p) => f(x, p[i]), points[0][i])));

/** Clip a polygon to where a linear function is at least 0. */
function cutPolygon(polygon, inside) {
  return polygon.flatMap((a, i) => {
    const b = polygon[(i + 1) % polygon.length];
    const [at, next] = [inside(a), inside(b)];
    const kept = at >= 0 ? [a] : [];
    return at >= 0 === next >= 0 ? kept : [...kept, Vec.along(a, Vec.sub(b, a), at / (at - next))];
  });
}

/** Clip a polygon to a box [low, high] along some axes. */
const cutToBox = (polygon, [low, high], axes) => axes.reduce((cut, axis) => {
  const above = cutPolygon(cut, (p) => p[axis] - low[axis]);
  return cutPolygon(above, (p) => high[axis] - p[axis]);
}, polygon);
