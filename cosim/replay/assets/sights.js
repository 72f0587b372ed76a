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

/**
 * Return the sight of a shape of attitude at a pose, shifted, of a size [m]: the camera's cone as far as its feature,
 * with the line of sight; without a feature the cone about the wanted heading, with that and the current heading.
 */
function sightOf({ sight }, { position, quaternion }, shift, size) {
  const R = Vec.matrix(quaternion);
  const turned = (v) => (sight.frame === "body" ? Vec.turned(R, v) : v);
  const [apex, axis] = [Vec.add(position, turned(sight.apex)), turned(sight.axis)];
  const feature = sight.feature && Vec.add(sight.feature, shift);
  const length = feature ? Math.max(3 * size, Vec.distance(feature, apex)) : 5 * size;
  const anchor = feature ?? Vec.along(apex, axis, length);
  const nose = Vec.along(apex, Vec.turned(R, [1, 0, 0]), 1.06 * length);
  const lines = [[apex, anchor], ...(feature ? [] : [[apex, nose]])];
  return { apex, axis, rim: rimOf(apex, axis, sight.half_angle, length), lines, feature, anchor };
}

/** Draw a region of attitude: a clear cone with its rim, the lines in it, and the feature as a cross in a circle. */
function paintSight(painter, { apex, rim, lines, feature }, { color, alpha, width, dash }) {
  const { context, camera } = painter;
  painter.begin();
  painter.polygon(rim);
  painter.fill(color, 0.25 * alpha);
  // the flanks: the triangles between the apex and all rim points cover the outline of the cone
  painter.begin();
  rim.forEach((p, i) => painter.polygon([apex, p, rim[(i + 1) % SIGHT_RINGS]]));
  painter.fill(color, 0.16 * alpha);
  painter.begin();
  painter.polygon(rim);
  for (let i = 0; i < SIGHT_RINGS; i += SIGHT_RINGS / 4) painter.segment(apex, rim[i]);
  painter.stroke(color, width, 0.9, dash);
  painter.begin();
  for (const line of lines) painter.line(line);
  painter.stroke(color, width, 0.8);
  const [x, y, depth] = feature ? camera.project(feature) : [];
  if (!(depth >= camera.near)) return;
  const r = width > 2 ? 9 : 7;
  const rays = [[1, 0], [-1, 0], [0, 1], [0, -1]];
  beginLines(context, ...rays.map(([u, v]) => [0.4 * r, 1.5 * r].map((off) => [x + off * u, y + off * v])));
  context.moveTo(x + r, y);
  context.arc(x, y, r, 0, 2 * Math.PI);
  painter.stroke(color, Math.max(1.8, width));
}
