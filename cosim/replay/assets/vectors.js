// Vectors of three numbers, and rotation matrices of quaternions, scalar first.

const Vec = {
  add: (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]],
  sub: (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]],
  scale: (a, k) => [k * a[0], k * a[1], k * a[2]],
  /** Return a + k b. */
  along: (a, b, k) => [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]],
  dot: (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2],
  cross: (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]],
  norm: (a) => Math.hypot(a[0], a[1], a[2]),
  unit(a) {
    const length = Math.hypot(a[0], a[1], a[2]);
    return [a[0] / length, a[1] / length, a[2] / length];
  },
  finite: (a) => a.every(Number.isFinite),

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
    const other = Math.abs(axis[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0];
    const first = Vec.unit(Vec.cross(other, axis));
    return [first, Vec.cross(axis, first)];
  },
};
