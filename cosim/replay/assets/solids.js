// Bounded regions as surfaces: points on g = 0, faces between them, and tests of what they hide.

const AROUND = 32; // pieces of half a great circle
const SHARP = Math.cos((31 * Math.PI) / 180); // faces that meet at a larger angle form a sharp edge
const CLUSTER = 32; // number of faces that share a bounding sphere
const LONG = 3; // times the radius of a sphere of equal volume-to-area ratio; a surface beyond that is long

/**
 * Surface of flat faces. Faces that meet at a blunt angle belong to one round surface.
 * @typedef {object} Solid
 * @property {number[][]} points [m, NED]
 * @property {number[][]} faces indices of points, anticlockwise as seen from outside
 * @property {number[][]} normals outward, of each face
 * @property {number[][]} edges [point, point, face, face, 1 if sharp]
 * @property {number[][]} lines of points on an ellipsoid, drawn to show its form
 * @property {number[]} center, {number} radius of its bounding sphere  @property {number} top its least depth [m]
 * @property {boolean} long true if its position is its nearest point, not its center
 * @property {object|null} ellipsoid {center, axes} of an ellipsoid: three half axes as vectors
 * @property {number[][][]} shadows closed lines, north and east, about what it hides from above
 * @property {function(number[]): function(number[]): boolean} from returns a test for an eye; the test is true for
 * points inside or behind the solid
 */

/** Return the surface of some points and faces. */
function solidOf(points, faces) {
  const normals = faces.map((face) => normalOf(face.map((k) => points[k])));
  const solid = { points, faces, normals, lines: [], ellipsoid: null, ...ballAbout(points) };
  solid.edges = edgesOf(faces, normals);
  solid.top = boxAbout(points)[0][2];
  solid.long = isLong(solid);
  solid.shadows = shadowsOf(solid);
  const clusters = clustersOf(points, faces);
  solid.from = (eye) => (p) => nearSight(solid, eye, p) &&
    clusters.some((cluster) => nearSight(cluster, eye, p) && crossesFaces(solid, cluster, eye, p));
  return solid;
}

/** Return a bounding sphere of some points: {center, radius}. */
function ballAbout(points) {
  const center = Vec.mean(boxAbout(points));
  return { center, radius: points.reduce((most, p) => Math.max(most, Vec.distance(p, center)), 0) };
}

/** Return runs of consecutive faces with bounding spheres, as most of a large surface is far from a line of sight. */
function clustersOf(points, faces) {
  return Array.from({ length: Math.ceil(faces.length / CLUSTER) }, (_, i) => {
    const [from, to] = [i * CLUSTER, Math.min((i + 1) * CLUSTER, faces.length)];
    return { from, to, ...ballAbout(faces.slice(from, to).flat().map((k) => points[k])) };
  });
}

/** Return the triangles of a surface, as corners. */
function trianglesOf({ points, faces }) {
  return faces.flatMap(([first, ...others]) =>
    others.slice(1).map((k, i) => [points[first], points[others[i]], points[k]]));
}

/** Return true if a surface is long for its volume and area, such as a pipe or a wall. */
function isLong(solid) {
  let [volume, area] = [0, 0];
  for (const [a, b, c] of trianglesOf(solid)) {
    volume += Vec.dot(a, Vec.cross(b, c)) / 6;
    area += Vec.norm(Vec.cross(Vec.sub(b, a), Vec.sub(c, a))) / 2;
  }
  return solid.radius * area > LONG * 3 * volume;
}

/** Return the one of some points that is nearest to another point. */
const nearestOf = (points, p) => points.reduce((a, b) => (Vec.distance(b, p) < Vec.distance(a, p) ? b : a));

/** Return the point of a surface that is nearest to another point. */
const nearestOnSurface = (solid, p) => nearestOf(trianglesOf(solid).map((corners) => nearestOnTriangle(corners, p)), p);

/** Return the point of a triangle that is nearest to another point. */
function nearestOnTriangle(corners, p) {
  const sides = corners.map((a, i) => [a, Vec.sub(corners[(i + 1) % 3], a)]);
  const normal = Vec.cross(sides[0][1], sides[1][1]);
  if (sides.every(([a, side]) => Vec.dot(Vec.cross(side, Vec.sub(p, a)), normal) >= 0)) {
    return Vec.along(p, normal, Vec.dot(Vec.sub(corners[0], p), normal) / Vec.dot(normal, normal));
  }
  const onSides = sides.map(([a, side]) =>
    Vec.along(a, side, clamp(Vec.dot(Vec.sub(p, a), side) / Vec.dot(side, side), 0, 1)));
  return nearestOf(onSides, p);
}

/** Return the unit normal of a polygon, after Newell; the polygon need not be convex. */
function normalOf(polygon) {
  const parts = polygon.map((a, i) => {
    const b = polygon[(i + 1) % polygon.length];
    return Vec.cross(Vec.sub(a, polygon[0]), Vec.sub(b, polygon[0]));
  });
  return Vec.unit(Vec.mean(parts));
}

function edgesOf(faces, normals) {
  const edges = new Map();
  faces.forEach((face, i) => {
    face.forEach((a, k) => {
      const b = face[(k + 1) % face.length];
      const key = a < b ? `${a} ${b}` : `${b} ${a}`;
      const known = edges.get(key);
      if (known) known.splice(3, 2, i, Vec.dot(normals[i], normals[known[2]]) < SHARP ? 1 : 0);
      else edges.set(key, [a, b, i, i, 1]);
    });
  });
  return [...edges.values()];
}

/** Return true if the line from an eye to a point crosses the bounding sphere of a solid. */
function nearSight({ center, radius }, eye, p) {
  const [sight, off] = [Vec.sub(eye, p), Vec.sub(p, center)];
  const part = clamp(-Vec.dot(off, sight) / Vec.dot(sight, sight), 0, 1);
  return Vec.norm(Vec.along(off, sight, part)) < radius;
}

/** Return true if the line from an eye to a point enters through a face: the point is inside or behind the solid. */
function crossesFaces({ points, faces, normals }, { from, to }, eye, p) {
  for (let i = from; i < to; i++) {
    const [corner, normal] = [points[faces[i][0]], normals[i]];
    const before = Vec.dot(normal, Vec.sub(eye, corner));
    const after = before > 0 ? Vec.dot(normal, Vec.sub(p, corner)) : 0;
    if (after >= 0) continue;
    const place = Vec.along(eye, Vec.sub(p, eye), before / (before - after));
    if (holds(faces[i].map((k) => points[k]), place, normal)) return true;
  }
  return false;
}

/** Return true if a polygon contains a point of its plane: a ray crosses its edges an odd number of times. */
function holds(polygon, p, normal) {
  const size = normal.map(Math.abs);
  const drop = size.indexOf(Math.max(...size)); // the axis along which its projection is largest
  const [u, v] = [0, 1, 2].filter((axis) => axis !== drop);
  const crossed = polygon.filter((a, i) => {
    const b = polygon[(i + 1) % polygon.length];
    return a[v] > p[v] !== b[v] > p[v] && p[u] < a[u] + ((p[v] - a[v]) / (b[v] - a[v])) * (b[u] - a[u]);
  });
  return crossed.length % 2 === 1;
}

/** Return an ellipsoid; it is drawn by its projected conic, so it has no faces, only points on great circles. */
function ellipsoidOf(center, axes) {
  const circles = [[0, 1], [1, 2], [2, 0]].map(([a, b]) => Array.from({ length: 2 * AROUND }, (_, i) => {
    const angle = (Math.PI * i) / AROUND;
    return Vec.along(Vec.along(center, axes[a], Math.cos(angle)), axes[b], Math.sin(angle));
  }));
  const lines = circles.map((circle, c) => [...circle.keys(), 0].map((i) => 2 * AROUND * c + i));
  const inverse = axes.map((axis) => Vec.scale(axis, 1 / Vec.dot(axis, axis))).flat(); // maps to the unit sphere
  const mapped = (p) => Vec.turned(inverse, Vec.sub(p, center));
  const from = (eye) => {
    const unitEye = mapped(eye);
    return (p) => {
      const q = mapped(p);
      const square = Vec.dot(q, q);
      if (square < 1) return true;
      const sight = Vec.sub(unitEye, q);
      const [along, length] = [Vec.dot(q, sight), Vec.dot(sight, sight)];
      return along < 0 && -along < length && square - (along * along) / length < 1; // nearest on the way to the eye
    };
  };
  return {
    points: circles.flat(), faces: [], normals: [], edges: [], lines, ellipsoid: { center, axes }, inverse, from,
    center, radius: Math.max(...axes.map(Vec.norm)), top: center[2] - Math.hypot(...axes.map((axis) => axis[2])),
    long: false, shadows: [ellipseFromAbove(center, axes)],
  };
}

const SURFACES = new WeakMap();

/** Return the surface of a bounded shape, made once for each object; null if the shape has no surface. */
function surfaceOf(shape) {
  if (!SURFACES.has(shape)) {
    const { center, half_axes: axes, points, faces } = shape.drawing ?? {};
    SURFACES.set(shape, axes ? ellipsoidOf(center, axes) : points ? solidOf(points, faces) : null);
  }
  return SURFACES.get(shape);
}
