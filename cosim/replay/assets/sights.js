// Regions of attitude: a cone about the wanted heading, and the field of view of a camera.

const SIGHT_RINGS = 36;

/** Return points on a circle: at an angle [rad] from a unit axis, and at a distance [m] from an apex. */
const rimOf = (apex, axis, angle, length) =>
  Vec.circle(Vec.along(apex, axis, length * Math.cos(angle)), axis, length * Math.sin(angle), SIGHT_RINGS);

/**
 * Drawing of a region of attitude.
 * @typedef {object} Sight
 * @property {number[]} apex, {number[]} axis of the cone  @property {number[][]} rim of the cone, on g = 0
 * @property {number[][][]} lines  @property {number[]|null} feature that the camera must see
 * @property {number[]} anchor of the label
 */

/** Functions from a shape of attitude, a pose, a shift and a size [m] to its sight. */
const SIGHTS = {
  /** Return the cone within the tolerance of the wanted heading, with lines along the wanted and current headings. */
  orientation(shape, { position, quaternion }, shift, size) {
    const [axis, nose] = [shape.quaternion, quaternion].map((q) => Vec.turned(Vec.matrix(q), [1, 0, 0]));
    const length = 5 * size;
    const wanted = Vec.along(position, axis, length);
    const lines = [[position, wanted], [position, Vec.along(position, nose, 1.06 * length)]];
    const rim = rimOf(position, axis, shape.tolerance, length);
    return { apex: position, axis, rim, lines, feature: null, anchor: wanted };
  },

  /** Return the camera's cone of view as far as the feature, and the line of sight to it. */
  visibility(shape, { position, quaternion }, shift, size) {
    const R = Vec.matrix(quaternion);
    const apex = Vec.add(position, Vec.turned(R, shape.camera_position));
    const axis = Vec.turned(R, Vec.unit(shape.camera_axis));
    const feature = Vec.add(shape.feature, shift);
    const rim = rimOf(apex, axis, shape.half_angle, Math.max(3 * size, Vec.distance(feature, apex)));
    return { apex, axis, rim, lines: [[apex, feature]], feature, anchor: feature };
  },
};

/** Draw a region of attitude: a clear cone with its rim, the lines in it, and the feature as a cross in a circle. */
function paintSight(painter, { apex, rim, lines, feature }, { colour, alpha, width, dash }) {
  const { context, camera } = painter;
  painter.begin();
  painter.polygon(rim);
  painter.fill(colour, 0.25 * alpha);
  // the flanks: the triangles between the apex and all rim points cover the outline of the cone
  painter.begin();
  rim.forEach((p, i) => painter.polygon([apex, p, rim[(i + 1) % SIGHT_RINGS]]));
  painter.fill(colour, 0.16 * alpha);
  painter.begin();
  painter.polygon(rim);
  for (let i = 0; i < SIGHT_RINGS; i += SIGHT_RINGS / 4) painter.segment(apex, rim[i]);
  painter.stroke(colour, width, 0.9, dash);
  painter.begin();
  for (const line of lines) painter.line(line);
  painter.stroke(colour, width, 0.8);
  const [x, y, depth] = feature ? camera.project(feature) : [];
  if (!(depth >= camera.near)) return;
  const r = width > 2 ? 9 : 7;
  const rays = [[1, 0], [-1, 0], [0, 1], [0, -1]];
  beginLines(context, ...rays.map(([u, v]) => [0.4 * r, 1.5 * r].map((off) => [x + off * u, y + off * v])));
  context.moveTo(x + r, y);
  context.arc(x, y, r, 0, 2 * Math.PI);
  painter.stroke(colour, Math.max(1.8, width));
}
