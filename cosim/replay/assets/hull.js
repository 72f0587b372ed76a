// The vehicle's hull, schematic and to scale: yellow floats on top of a frame, a dome as the nose,
// and ducts on the lines of action of the thrusters.

/**
 * Face of a hull for a radius of 1, body axes: forward, starboard, down.
 * @typedef {object} HullFace
 * @property {string} color name of a color of the theme
 * @property {number[][]} corners  @property {number[]} middle, normal
 */

/** Return the faces of a closed body between rings of as many points each, anticlockwise as seen from outside. */
function hullTube(color, rings) {
  const bands = rings.slice(1).flatMap((ring, k) => ring.map((_, i) => {
    const next = (i + 1) % ring.length;
    return [rings[k][i], rings[k][next], ring[next], ring[i]];
  }));
  const faces = [rings[0].toReversed(), rings.at(-1), ...bands];
  return faces.map((corners) => ({ color, corners, middle: Vec.mean(corners), normal: normalOf(corners) }));
}

/** Return the faces of a profile (forward, down) that is extruded from one side to the other. */
const hullProfile = (color, profile, from, to) =>
  hullTube(color, [from, to].map((y) => profile.toReversed().map(([x, z]) => [x, y, z])));

const hullBar = (color, [x, y, z], [a, b, c]) =>
  hullProfile(color, [[x + a, z - c], [x - a, z - c], [x - a, z + c], [x + a, z + c]], y - b, y + b);

/** Return a ring of `count` points about an axis. */
const hullRing = (center, axis, radius, count) => Vec.circle(center, axis, radius, count, 0.5);

/** Return the faces of an open frame with floats, a tube and a dome. */
function frameFaces() {
  const float = [[0.98, -0.36], [0.8, -0.68], [-0.86, -0.68], [-0.98, -0.52], [-0.98, -0.24], [0.9, -0.24]];
  const along = (x, radius) => hullRing([x, 0, 0.12], [1, 0, 0], radius, 12);
  return [
    ...[-1, 1].flatMap((side) => [
      ...hullProfile("float", float, ...(side < 0 ? [-0.76, -0.2] : [0.2, 0.76])),
      ...[-0.78, 0.7].flatMap((x) => hullBar("frame", [x, 0.7 * side, 0.16], [0.06, 0.05, 0.4])),
      ...hullBar("skid", [-0.02, 0.7 * side, 0.62], [0.98, 0.07, 0.06]),
    ]),
    ...[-0.78, 0.7].flatMap((x) => hullBar("frame", [x, 0, 0.5], [0.05, 0.64, 0.05])),
    ...hullTube("tube", [along(-0.8, 0.3), along(0.66, 0.3)]),
    ...hullTube("dome", [along(0.66, 0.3), along(0.84, 0.25), along(0.95, 0.14), along(0.98, 0.04)]),
  ];
}

/** Return the faces of a sphere with a dome as the nose. */
function ballFaces() {
  const rings = Array.from({ length: 12 }, (_, k) => {
    const angle = (Math.PI * (k + 0.5)) / 12;
    return hullRing([-Math.cos(angle), 0, 0], [1, 0, 0], Math.sin(angle), 20);
  });
  return [...hullTube("float", rings.slice(0, 11)), ...hullTube("dome", rings.slice(10))];
}

/** Return the faces of the thrusters' ducts, and of struts to ducts outside of the frame. */
function thrusterFaces({ thrusters, radius }) {
  return thrusters.flatMap(({ position, direction }) => {
    const axis = Vec.unit(direction);
    const at = Vec.scale(position, 1 / radius);
    const duct = hullTube("duct", [-0.1, 0.1].map((x) => hullRing(Vec.along(at, axis, x), axis, 0.2, 9)));
    if (Vec.norm(at) < 1.2) return duct;
    const out = Vec.unit(at);
    const strut = [0.6, Vec.norm(at) - 0.18].map((x) => hullRing(Vec.scale(out, x), out, 0.05, 4));
    return [...duct, ...hullTube("frame", strut)];
  });
}

const SHAPES = { frame: frameFaces(), sphere: ballFaces() }; // by `hull` of the header's vehicle
const HULLS = new WeakMap();

/** Return the faces of a vehicle; they are made once. @returns {HullFace[]} */
function hullOf(vehicle) {
  if (!HULLS.has(vehicle)) HULLS.set(vehicle, [...SHAPES[vehicle.hull], ...thrusterFaces(vehicle)]);
  return HULLS.get(vehicle);
}
