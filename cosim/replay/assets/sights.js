// Regions of attitude: a cone about the wanted heading, and the field of view of a camera.

const SIGHT_RINGS = 36;

/** Return points on a circle: at an angle [rad] from a unit axis, and at a distance [m] from an apex. */
function rimOf(apex, axis, angle, length) {
  const [first, second] = Vec.aside(axis);
  const centre = Vec.along(apex, axis, length * Math.cos(angle));
  const radius = length * Math.sin(angle);
  return Array.from({ length: SIGHT_RINGS }, (_, i) => {
    const turn = (2 * Math.PI * i) / SIGHT_RINGS;
    return Vec.along(Vec.along(centre, first, radius * Math.cos(turn)), second, radius * Math.sin(turn));
  });
}

/**
 * Drawing of a region of attitude.
 * @typedef {object} Sight
 * @property {number[]} apex, {number[]} axis of the cone  @property {number[][]} rim of the cone, on g = 0
 * @property {number[][][]} lines  @property {number[]|null} feature that the camera must see
 * @property {number[]} anchor of the label
 */

/** Functions from a shape of attitude, a pose, a shift and a size [m] to its sight. */
const SIGHTS = {
  /** Return the cone within the tolerance of the wanted heading, with lines along the wanted and the current heading. */
  orientation(shape, { position, quaternion }, shift, size) {
    const axis = Vec.turned(Vec.matrix(shape.quaternion), [1, 0, 0]);
    const nose = Vec.turned(Vec.matrix(quaternion), [1, 0, 0]);
    const length = 5 * size;
    const rim = rimOf(position, axis, shape.tolerance, length);
    const wanted = Vec.along(position, axis, length);
    const lines = [[position, wanted], [position, Vec.along(position, nose, 1.06 * length)]];
    return { apex: position, axis, rim, lines, feature: null, anchor: wanted };
  },

  /** Return the camera's cone of view as far as the feature, and the line of sight to it. */
  visibility(shape, { position, quaternion }, shift, size) {
    const R = Vec.matrix(quaternion);
    const apex = Vec.add(position, Vec.turned(R, shape.camera_position));
    const axis = Vec.turned(R, Vec.unit(shape.camera_axis));
    const feature = Vec.add(shape.feature, shift);
    const length = Math.max(3 * size, Vec.norm(Vec.sub(feature, apex)));
    const rim = rimOf(apex, axis, shape.half_angle, length);
    return { apex, axis, rim, lines: [[apex, feature]], feature, anchor: feature };
  },
};

/** Draw a region of attitude: a clear cone with its rim, the lines in it, and the feature as a cross in a circle. */
function paintSight(painter, sight, style) {
  const { context, camera } = painter;
  painter.begin();
  painter.polygon(sight.rim);
  painter.fill(style.colour, 0.25 * style.alpha);
  // the flanks: the triangles between the apex and all rim points cover the outline of the cone
  painter.begin();
  for (let i = 0; i < SIGHT_RINGS; i++) painter.polygon([sight.apex, sight.rim[i], sight.rim[(i + 1) % SIGHT_RINGS]]);
  painter.fill(style.colour, 0.16 * style.alpha);
  painter.begin();
  painter.polygon(sight.rim);
  for (let i = 0; i < SIGHT_RINGS; i += SIGHT_RINGS / 4) painter.segment(sight.apex, sight.rim[i]);
  painter.stroke(style.colour, style.width, 0.9, style.dash);
  painter.begin();
  for (const line of sight.lines) painter.line(line);
  painter.stroke(style.colour, style.width, 0.8);
  if (!sight.feature) return;
  const [x, y, depth] = camera.project(sight.feature);
  if (depth < camera.near) return;
  const r = style.width > 2 ? 9 : 7;
  context.beginPath();
  context.arc(x, y, r, 0, 2 * Math.PI);
  for (const [u, v] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
    context.moveTo(x + 0.4 * r * u, y + 0.4 * r * v);
    context.lineTo(x + 1.5 * r * u, y + 1.5 * r * v);
  }
  painter.stroke(style.colour, Math.max(1.8, style.width));
}
