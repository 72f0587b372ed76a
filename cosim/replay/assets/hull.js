// The vehicle's hull, schematic and to scale: yellow floats on top of a frame, a dome as the nose,
// and ducts on the lines of action of the thrusters.

/**
 * Face of a hull for a radius of 1, body axes: forward, starboard, down.
 * @typedef {object} HullFace
 * @property {string} colour name of a color of the theme's hull
 * @property {number[][]} corners  @property {number[]} middle, normal
 */

/** Return faces that share points, given by indices, anticlockwise as seen from outside. */
function hullPart(colour, points, polygons) {
  return polygons.map((polygon) => {
    const corners = polygon.map((i) => points[i]);
    const middle = corners.reduce((sum, p) => Vec.along(sum, p, 1 / corners.length), [0, 0, 0]);
    return { colour, corners, middle, normal: normalOf(corners) };
  });
}

/** Return the faces between two rings of `count` points, given by the indices of their first points. */
function bandFaces(from, to, count) {
  return Array.from({ length: count }, (_, i) => {
    const next = (i + 1) % count;
    return [from + i, from + next, to + next, to + i];
  });
}

/** Return the faces of a closed body between rings of as many points each. */
function hullTube(colour, rings) {
  const n = rings[0].length;
  const around = Array.from({ length: n }, (_, i) => i);
  const faces = [[...around].reverse(), around.map((i) => (rings.length - 1) * n + i)];
  for (let k = 1; k < rings.length; k++) faces.push(...bandFaces((k - 1) * n, k * n, n));
  return hullPart(colour, rings.flat(), faces);
}

/** Return the faces of a profile (forward, down) that is extruded from one side to the other. */
const hullProfile = (colour, profile, from, to) =>
  hullTube(colour, [from, to].map((y) => [...profile].reverse().map(([x, z]) => [x, y, z])));

const hullBar = (colour, [x, y, z], [a, b, c]) =>
  hullProfile(colour, [[x + a, z - c], [x - a, z - c], [x - a, z + c], [x + a, z + c]], y - b, y + b);

/** Return a ring of `count` points about an axis. */
function hullRing(centre, axis, radius, count) {
  const [first, second] = Vec.aside(axis);
  return Array.from({ length: count }, (_, i) => {
    const angle = (2 * Math.PI * (i + 0.5)) / count;
    return Vec.along(Vec.along(centre, first, radius * Math.cos(angle)), second, radius * Math.sin(angle));
  });
}

/** Return the faces of an open frame with floats, a tube and a dome. */
function frameFaces() {
  const faces = [];
  const float = [[0.98, -0.36], [0.8, -0.68], [-0.86, -0.68], [-0.98, -0.52], [-0.98, -0.24], [0.9, -0.24]];
  for (const side of [-1, 1]) {
    const [inner, outer] = side < 0 ? [-0.76, -0.2] : [0.2, 0.76];
    faces.push(...hullProfile("float", float, inner, outer));
    for (const x of [-0.78, 0.7]) faces.push(...hullBar("frame", [x, 0.7 * side, 0.16], [0.06, 0.05, 0.4]));
    faces.push(...hullBar("skid", [-0.02, 0.7 * side, 0.62], [0.98, 0.07, 0.06]));
  }
  for (const x of [-0.78, 0.7]) faces.push(...hullBar("frame", [x, 0, 0.5], [0.05, 0.64, 0.05]));
  const along = (x, radius) => hullRing([x, 0, 0.12], [1, 0, 0], radius, 12);
  faces.push(...hullTube("tube", [along(-0.8, 0.3), along(0.66, 0.3)]));
  faces.push(...hullTube("dome", [along(0.66, 0.3), along(0.84, 0.25), along(0.95, 0.14), along(0.98, 0.04)]));
  return faces;
}

/** Return the faces of a sphere with a dome as the nose. */
function ballFaces() {
  const ring = (k) => hullRing([-Math.cos((Math.PI * k) / 12), 0, 0], [1, 0, 0], Math.sin((Math.PI * k) / 12), 20);
  const rings = Array.from({ length: 12 }, (_, k) => ring(k + 0.5));
  return [...hullTube("float", rings.slice(0, 11)), ...hullTube("dome", rings.slice(10))];
}

/** Return the faces of the thrusters' ducts, and of struts to ducts outside of the frame. */
function thrusterFaces({ thrusters, radius }) {
  return thrusters.flatMap(({ position, direction }) => {
    const axis = Vec.unit(direction);
    const at = Vec.scale(position, 1 / radius);
    const duct = [-0.1, 0.1].map((x) => hullRing(Vec.along(at, axis, x), axis, 0.2, 9));
    const faces = hullTube("duct", duct);
    if (Vec.norm(at) < 1.2) return faces;
    const out = Vec.unit(at);
    const strut = [0.6, Vec.norm(at) - 0.18].map((x) => hullRing(Vec.scale(out, x), out, 0.05, 4));
    return [...faces, ...hullTube("frame", strut)];
  });
}

const SHAPES = { frame: frameFaces(), sphere: ballFaces() }; // by `hull` of the header's vehicle
const HULLS = new WeakMap();

/** Return the faces of a vehicle; they are made once. @returns {HullFace[]} */
function hullOf(vehicle) {
  if (!HULLS.has(vehicle)) HULLS.set(vehicle, [...SHAPES[vehicle.hull], ...thrusterFaces(vehicle)]);
  return HULLS.get(vehicle);
}
