// Regions of space that end somewhere, as surfaces: points on g = 0, faces between them, and where they hide things.

const AROUND = 32; // faces around what is round
const SHARP = Math.cos((31 * Math.PI) / 180); // faces that turn more from each other are seen as an edge

/**
 * A surface of flat faces. Faces that meet bluntly belong to one round surface.
 * @typedef {object} Solid
 * @property {Float64Array} points three numbers each [m, NED]
 * @property {number[][]} faces indices of points, anticlockwise as seen from outside
 * @property {Float64Array} normals outward, three numbers for each face
 * @property {number[][]} edges [point, point, face, face, 1 if sharp]
 * @property {number[][]} lines of points on an ellipsoid, drawn to tell its form
 * @property {number[]} centre, {number} radius of a ball about it  @property {number} top its least depth [m]
 * @property {number[][]|null} spine the line in its middle, where it is long
 * @property {object|null} ellipsoid {centre, axes} where it is one: three half axes as vectors
 * @property {number[][][]} shadows polygons, north and east, that it is seen as from above
 * @property {function(number[]): function(number, number, number): boolean} from tells of an eye whether the solid is
 * between it and a point, or holds the point; asked for each piece of a way in each frame, so it makes no arrays
 */

/** The surface that some points and faces make. */
function solidOf(points, faces, lines = []) {
  const solid = { points: Float64Array.from(points.flat()), faces, lines, spine: null, ellipsoid: null };
  solid.normals = new Float64Array(3 * faces.length);
  faces.forEach((face, i) => solid.normals.set(normalOf(face.map((k) => points[k])), 3 * i));
  solid.edges = edgesOf(faces, solid.normals);
  const low = [0, 1, 2].map((axis) => Math.min(...points.map((p) => p[axis])));
  const high = [0, 1, 2].map((axis) => Math.max(...points.map((p) => p[axis])));
  solid.centre = Vec.scale(Vec.add(low, high), 0.5);
  solid.radius = Math.max(...points.map((p) => Vec.norm(Vec.sub(p, solid.centre))));
  solid.top = low[2];
  solid.from = (eye) => (x, y, z) => nearSight(solid, eye, x, y, z) && crossesFaces(solid, eye, [x, y, z]);
  solid.shadows = faces.length ? [outlineFromAbove(points)] : [];
  return solid;
}

/** The unit normal of a polygon, after Newell: it need not be convex. */
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

/** Whether a line from an eye to a point goes through the ball about a solid. */
function nearSight({ centre, radius }, eye, x, y, z) {
  const [bx, by, bz] = [eye[0] - x, eye[1] - y, eye[2] - z];
  const [px, py, pz] = [x - centre[0], y - centre[1], z - centre[2]];
  const length = bx * bx + by * by + bz * bz;
  const part = Math.min(1, Math.max(0, -(px * bx + py * by + pz * bz) / length));
  return (px + part * bx) ** 2 + (py + part * by) ** 2 + (pz + part * bz) ** 2 < radius * radius;
}

/** Whether a line from an eye to a point goes in through a face: then the point is inside the solid or behind it. */
function crossesFaces(solid, eye, p) {
  const { points, faces, normals } = solid;
  for (let i = 0; i < faces.length; i++) {
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

/** Whether a polygon holds a point of its plane: a ray crosses its edges an odd number of times. */
function holds(points, face, p, normal) {
  const size = normal.map(Math.abs);
  const drop = size.indexOf(Math.max(...size)); // the axis along which it is seen broadest
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

/** An ellipsoid: drawn by the conic that it is seen as, so that it needs no faces; its points are on great circles. */
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
  const inverse = axes.map((axis) => Vec.scale(axis, 1 / Vec.dot(axis, axis))); // rows: into the unit ball
  solid.from = (eye) => {
    // all in the space where it is the unit ball
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

function boxOf(shape) {
  const R = Vec.matrix(shape.quaternion);
  const points = [];
  for (let i = 0; i < 8; i++) {
    const half = shape.size.map((size, axis) => (i & (1 << axis) ? 0.5 : -0.5) * size);
    points.push(Vec.add(shape.centre, Vec.turned(R, half)));
  }
  return solidOf(points, [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]);
}

/** Faces between rings of as many points each, one behind the other as the outward side is to the right of it. */
function bandFaces(from, to, count) {
  return Array.from({ length: count }, (_, i) => {
    const next = (i + 1) % count;
    return [from + i, from + next, to + next, to + i];
  });
}

function ring(centre, first, second, radius) {
  return Array.from({ length: AROUND }, (_, i) => {
    const angle = (2 * Math.PI * i) / AROUND;
    return Vec.along(Vec.along(centre, first, radius * Math.cos(angle)), second, radius * Math.sin(angle));
  });
}

function cylinderOf(shape) {
  const axis = Vec.unit(Vec.sub(shape.end, shape.start));
  const [first, second] = Vec.aside(axis);
  const points = [...ring(shape.start, first, second, shape.radius), ...ring(shape.end, first, second, shape.radius)];
  const around = Array.from({ length: AROUND }, (_, i) => i);
  const ends = [[...around].reverse(), around.map((i) => AROUND + i)];
  const solid = solidOf(points, [...bandFaces(0, AROUND, AROUND), ...ends]);
  solid.spine = [shape.start, shape.end];
  return solid;
}

function prismOf(shape) {
  const n = shape.corners.length;
  const area = shape.corners.reduce((sum, [x, y], i) => {
    const [u, v] = shape.corners[(i + 1) % n];
    return sum + x * v - u * y;
  }, 0);
  const corners = area > 0 ? shape.corners : [...shape.corners].reverse();
  const points = [shape.top, shape.bottom].flatMap((depth) => corners.map(([x, y]) => [x, y, depth]));
  const around = corners.map((_, i) => i);
  const solid = solidOf(points, [...bandFaces(0, n, n), [...around].reverse(), around.map((i) => n + i)]);
  solid.shadows = [corners];
  return solid;
}

/** A cone that ends in a part of a ball. */
function coneOf(shape) {
  const axis = Vec.unit(shape.axis);
  const [first, second] = Vec.aside(axis);
  const rings = 6;
  const points = [[...shape.feature]];
  for (let k = rings; k > 0; k--) {
    const angle = (shape.half_angle * k) / rings;
    const centre = Vec.along(shape.feature, axis, shape.range * Math.cos(angle));
    points.push(...ring(centre, first, second, shape.range * Math.sin(angle)));
  }
  points.push(Vec.along(shape.feature, axis, shape.range));
  const faces = Array.from({ length: AROUND }, (_, i) => [0, 1 + ((i + 1) % AROUND), 1 + i]);
  for (let k = 1; k < rings; k++) faces.push(...bandFaces(1 + (k - 1) * AROUND, 1 + k * AROUND, AROUND));
  const last = 1 + (rings - 1) * AROUND;
  for (let i = 0; i < AROUND; i++) faces.push([last + i, last + ((i + 1) % AROUND), points.length - 1]);
  return solidOf(points, faces);
}

/** How the surface of each kind of bounded shape is made, from its fields. */
const SOLIDS = {
  sphere: ({ centre, radius }) => ellipsoidOf(centre, [[radius, 0, 0], [0, radius, 0], [0, 0, radius]]),
  ellipsoid({ centre, semi_axes, quaternion }) {
    const R = Vec.matrix(quaternion);
    return ellipsoidOf(centre, semi_axes.map((a, i) => [a * R[i], a * R[3 + i], a * R[6 + i]]));
  },
  box: boxOf,
  cylinder: cylinderOf,
  prism: prismOf,
  cone: coneOf,
  pipe: pipeOf,
};

/** How the surface of a shape is made: of its mesh where it brings one, else of its numbers; none where it has no end. */
const solidMaker = (shape) => (shape.mesh ? ({ mesh }) => solidOf(mesh.points, mesh.faces) : SOLIDS[shape.kind]);
