// Bounded regions as surfaces: points on g = 0, faces between them, and tests of what they hide.

const AROUND = 32; // pieces of half a great circle
const SHARP = Math.cos((31 * Math.PI) / 180); // faces that meet at a larger angle form a sharp edge
const CLUSTER = 32; // number of faces that share a bounding sphere
const LONG = 3; // times the radius of a sphere of equal volume-to-area ratio; a surface beyond that is long

/**
 * Surface of flat faces. Faces that meet at a blunt angle belong to one round surface.
 * @typedef {object} Solid
 * @property {Float64Array} points three numbers each [m, NED]
 * @property {number[][]} faces indices of points, anticlockwise as seen from outside
 * @property {Float64Array} normals outward, three numbers for each face
 * @property {number[][]} edges [point, point, face, face, 1 if sharp]
 * @property {number[][]} lines of points on an ellipsoid, drawn to show its form
 * @property {number[]} centre, {number} radius of its bounding sphere  @property {number} top its least depth [m]
 * @property {boolean} long true if its position is its nearest point, not its center
 * @property {object|null} ellipsoid {centre, axes} of an ellipsoid: three half axes as vectors
 * @property {number[][][]} shadows closed lines, north and east, about what it hides from above
 * @property {function(number[]): function(number, number, number): boolean} from returns a test for an eye; the test is true
 * for points inside or behind the solid. It runs for each piece of a path in each frame, so it makes few arrays
 */

/** Return the surface of some points and faces. */
function solidOf(points, faces, lines = []) {
  const solid = { points: Float64Array.from(points.flat()), faces, lines, long: false, ellipsoid: null };
  solid.normals = new Float64Array(3 * faces.length);
  faces.forEach((face, i) => solid.normals.set(normalOf(face.map((k) => points[k])), 3 * i));
  solid.edges = edgesOf(faces, solid.normals);
  Object.assign(solid, ballAbout(points));
  solid.top = points.reduce((top, p) => Math.min(top, p[2]), Infinity);
  if (!faces.length) return solid;
  solid.long = isLong(solid);
  solid.shadows = shadowsOf(solid);
  const clusters = clustersOf(points, faces);
  solid.from = (eye) => (x, y, z) =>
    nearSight(solid, eye, x, y, z) &&
    clusters.some((cluster) => nearSight(cluster, eye, x, y, z) && crossesFaces(solid, cluster, eye, [x, y, z]));
  return solid;
}

/** Return a bounding sphere of some points: {centre, radius}. */
function ballAbout(points) {
  const [low, high] = [Math.min, Math.max].map((most) =>
    [0, 1, 2].map((axis) => points.reduce((x, p) => most(x, p[axis]), points[0][axis])),
  );
  const centre = Vec.scale(Vec.add(low, high), 0.5);
  return { centre, radius: points.reduce((most, p) => Math.max(most, Vec.norm(Vec.sub(p, centre))), 0) };
}

/** Return runs of consecutive faces with bounding spheres, as most of a large surface is far from a line of sight. */
function clustersOf(points, faces) {
  const clusters = [];
  for (let from = 0; from < faces.length; from += CLUSTER) {
    const to = Math.min(from + CLUSTER, faces.length);
    clusters.push({ from, to, ...ballAbout(faces.slice(from, to).flatMap((face) => face.map((k) => points[k]))) });
  }
  return clusters;
}

/** Return true if a surface is long for its volume and area, such as a pipe or a wall. */
function isLong({ points, faces, radius }) {
  let [volume, area] = [0, 0];
  const corner = (k) => [points[3 * k], points[3 * k + 1], points[3 * k + 2]];
  for (const [first, ...others] of faces) {
    for (let i = 1; i < others.length; i++) {
      const [a, b, c] = [first, others[i - 1], others[i]].map(corner);
      volume += Vec.dot(a, Vec.cross(b, c)) / 6;
      area += Vec.norm(Vec.cross(Vec.sub(b, a), Vec.sub(c, a))) / 2;
    }
  }
  return radius * area > LONG * 3 * volume;
}

/** Return the point of a surface that is nearest to another point. */
function nearestOnSurface({ points, faces }, p) {
  let nearest = null;
  let least = Infinity;
  const corner = (k) => [points[3 * k], points[3 * k + 1], points[3 * k + 2]];
  for (const face of faces) {
    const [first, ...others] = face.map(corner);
    for (let i = 1; i < others.length; i++) {
      const q = nearestOnTriangle(first, others[i - 1], others[i], p);
      const off = Vec.norm(Vec.sub(q, p));
      if (off < least) [nearest, least] = [q, off];
    }
  }
  return nearest;
}

/** Return the point of a triangle that is nearest to another point. */
function nearestOnTriangle(a, b, c, p) {
  const normal = Vec.cross(Vec.sub(b, a), Vec.sub(c, a));
  const inside = (u, v) => Vec.dot(Vec.cross(Vec.sub(v, u), Vec.sub(p, u)), normal) >= 0;
  if (inside(a, b) && inside(b, c) && inside(c, a)) {
    return Vec.along(p, normal, Vec.dot(Vec.sub(a, p), normal) / Vec.dot(normal, normal));
  }
  return nearestOnChain([a, b, c, a], p);
}

/** Return the point of a polyline that is nearest to another point. */
function nearestOnChain(chain, p) {
  let nearest = chain[0];
  let least = Infinity;
  for (let i = 1; i < chain.length; i++) {
    const way = Vec.sub(chain[i], chain[i - 1]);
    const part = Vec.dot(Vec.sub(p, chain[i - 1]), way) / Vec.dot(way, way);
    const q = Vec.along(chain[i - 1], way, Math.min(1, Math.max(0, part)));
    const off = Vec.norm(Vec.sub(q, p));
    if (off < least) [nearest, least] = [q, off];
  }
  return nearest;
}

/** Return the unit normal of a polygon, after Newell; the polygon need not be convex. */
function normalOf(polygon) {
  let normal = [0, 0, 0];
  polygon.forEach((a, i) => {
    const b = polygon[(i + 1) % polygon.length];
    normal = Vec.add(normal, Vec.cross(Vec.sub(a, polygon[0]), Vec.sub(b, polygon[0])));
  });
  return Vec.unit(normal);
}

function edgesOf(faces, normals) {
  const edges = new Map();
  faces.forEach((face, i) => {
    face.forEach((a, k) => {
      const b = face[(k + 1) % face.length];
      const key = a < b ? `${a} ${b}` : `${b} ${a}`;
      const known = edges.get(key);
      if (!known) edges.set(key, [a, b, i, i, 1]);
      else {
        const j = known[2];
        const bend = [0, 1, 2].reduce((sum, axis) => sum + normals[3 * i + axis] * normals[3 * j + axis], 0);
        known[3] = i;
        known[4] = bend < SHARP ? 1 : 0;
      }
    });
  });
  return [...edges.values()];
}

/** Return true if the line from an eye to a point crosses the bounding sphere of a solid. */
function nearSight({ centre, radius }, eye, x, y, z) {
  const [bx, by, bz] = [eye[0] - x, eye[1] - y, eye[2] - z];
  const [px, py, pz] = [x - centre[0], y - centre[1], z - centre[2]];
  const length = bx * bx + by * by + bz * bz;
  const part = Math.min(1, Math.max(0, -(px * bx + py * by + pz * bz) / length));
  return (px + part * bx) ** 2 + (py + part * by) ** 2 + (pz + part * bz) ** 2 < radius * radius;
}

/** Return true if the line from an eye to a point enters through a face: the point is inside or behind the solid. */
function crossesFaces({ points, faces, normals }, { from, to }, eye, p) {
  for (let i = from; i < to; i++) {
    const [nx, ny, nz] = [normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]];
    const v = 3 * faces[i][0];
    const before = nx * (eye[0] - points[v]) + ny * (eye[1] - points[v + 1]) + nz * (eye[2] - points[v + 2]);
    const after = nx * (p[0] - points[v]) + ny * (p[1] - points[v + 1]) + nz * (p[2] - points[v + 2]);
    if (before <= 0 || after >= 0) continue;
    const part = before / (before - after);
    if (holds(points, faces[i], Vec.along(eye, Vec.sub(p, eye), part), [nx, ny, nz])) return true;
  }
  return false;
}

/** Return true if a polygon contains a point of its plane: a ray crosses its edges an odd number of times. */
function holds(points, face, p, normal) {
  const size = normal.map(Math.abs);
  const drop = size.indexOf(Math.max(...size)); // the axis along which its projection is largest
  const [u, v] = [0, 1, 2].filter((axis) => axis !== drop);
  let inside = false;
  for (let i = 0; i < face.length; i++) {
    const a = 3 * face[i];
    const b = 3 * face[(i + 1) % face.length];
    const [au, av, bu, bv] = [points[a + u], points[a + v], points[b + u], points[b + v]];
    if (av > p[v] !== bv > p[v] && p[u] < au + ((p[v] - av) / (bv - av)) * (bu - au)) inside = !inside;
  }
  return inside;
}

/** Return an ellipsoid; it is drawn by its projected conic, so it has no faces, only points on great circles. */
function ellipsoidOf(centre, axes) {
  const points = [];
  const lines = [];
  for (const [a, b] of [[0, 1], [1, 2], [2, 0]]) {
    const line = [];
    for (let i = 0; i < 2 * AROUND; i++) {
      const angle = (Math.PI * i) / AROUND;
      line.push(points.length);
      points.push(Vec.along(Vec.along(centre, axes[a], Math.cos(angle)), axes[b], Math.sin(angle)));
    }
    lines.push([...line, line[0]]);
  }
  const solid = solidOf(points, [], lines);
  solid.centre = [...centre];
  solid.radius = Math.max(...axes.map(Vec.norm));
  solid.top = centre[2] - Math.hypot(...axes.map((axis) => axis[2]));
  solid.ellipsoid = { centre: solid.centre, axes };
  solid.shadows = [ellipseFromAbove(centre, axes)];
  const inverse = axes.map((axis) => Vec.scale(axis, 1 / Vec.dot(axis, axis))); // rows map to the unit sphere
  solid.from = (eye) => {
    // in coordinates in which the ellipsoid is the unit sphere
    const [[m0, m1, m2], [m3, m4, m5], [m6, m7, m8]] = inverse;
    const [cx, cy, cz] = centre;
    const [ex, ey, ez] = inverse.map((row) => Vec.dot(row, Vec.sub(eye, centre)));
    return (x, y, z) => {
      const [dx, dy, dz] = [x - cx, y - cy, z - cz];
      const px = m0 * dx + m1 * dy + m2 * dz;
      const py = m3 * dx + m4 * dy + m5 * dz;
      const pz = m6 * dx + m7 * dy + m8 * dz;
      const square = px * px + py * py + pz * pz;
      if (square < 1) return true;
      const [bx, by, bz] = [ex - px, ey - py, ez - pz];
      const along = px * bx + py * by + pz * bz;
      const length = bx * bx + by * by + bz * bz;
      return along < 0 && -along < length && square - (along * along) / length < 1; // nearest on the way to the eye
    };
  };
  return solid;
}

/** Return the surface of a bounded shape, made once for each object; null if the shape has no surface. */
function surfaceOf(shape) {
  if (!SURFACES.has(shape)) {
    const { centre, half_axes: axes, points, faces } = shape.drawing ?? {};
    SURFACES.set(shape, axes ? ellipsoidOf(centre, axes) : points ? solidOf(points, faces) : null);
  }
  return SURFACES.get(shape);
}

const SURFACES = new WeakMap();
