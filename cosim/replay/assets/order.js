// Drawing order: planes split the scene, bounded surfaces are sorted by distance, thin things by what hides them.

/**
 * Entry that can hide others: a surface or a sheet of a region.
 * @typedef {object} Entry
 * @property {Solid|null} solid  @property {Sheet|null} sheet  @property {number[]} shift [m, NED]
 * @property {object} style  @property {number[]} middle position for the order [m, NED]
 */

/** Return the entries from the farthest to the nearest; a sheet separates entries beyond it from those before it. */
function farthestFirst(entries, eye) {
  const sheets = entries.filter((entry) => entry.sheet);
  if (!sheets.length) return [...entries].sort((a, b) => remoteness(b, eye) - remoteness(a, eye));
  const sheet = sheets[0];
  const side = (p) => Vec.dot(Vec.sub(p, sheet.sheet.corners[0]), sheet.sheet.normal) > 0;
  const others = entries.filter((entry) => entry !== sheet);
  const eyeSide = side(eye);
  const beyond = others.filter((entry) => side(entry.middle) !== eyeSide);
  const before = others.filter((entry) => side(entry.middle) === eyeSide);
  return [...farthestFirst(beyond, eye), sheet, ...farthestFirst(before, eye)];
}

/**
 * Return the sort key of an entry: the power of the eye about its sphere [m^2]; other surfaces count as points.
 *
 * Of two spheres that do not touch, the one with the smaller power is never behind the other.
 */
function remoteness({ solid, middle }, eye) {
  const off = Vec.sub(middle, eye);
  const radius = solid.ellipsoid ? solid.radius : 0;
  return Vec.dot(off, off) - radius * radius;
}

/** Return a function that is true for points that an entry hides or contains; null for an entry that is clear. */
function hiderOf({ solid, sheet, shift, style }, eye) {
  if (sheet) return throughSheet(sheet, eye);
  if (!style.filled) return null;
  const [sx, sy, sz] = shift;
  const hides = solid.from(Vec.sub(eye, shift));
  return (x, y, z) => hides(x - sx, y - sy, z - sz);
}

function throughSheet({ corners, normal }, eye) {
  const [nx, ny, nz] = normal;
  const offset = Vec.dot(normal, corners[0]);
  const before = Vec.dot(normal, eye) - offset;
  const [points, face] = [corners.flat(), corners.map((_, i) => i)];
  return (x, y, z) => {
    const after = nx * x + ny * y + nz * z - offset;
    if (before > 0 === after > 0) return false;
    const at = Vec.along(eye, [x - eye[0], y - eye[1], z - eye[2]], before / (before - after));
    return holds(points, face, at, normal);
  };
}

/** Return thin things in lists: list k is drawn before entry k, the first that hides them; the last list is on top. */
function placedAmong(entries, things, eye) {
  const lists = Array.from({ length: entries.length + 1 }, () => []);
  const hiders = entries.map((entry) => hiderOf(entry, eye));
  for (const thing of things) {
    const [x, y, z] = thing.middle;
    let k = 0;
    while (k < entries.length && !hiders[k]?.(x, y, z)) k++;
    thing.off = (x - eye[0]) ** 2 + (y - eye[1]) ** 2 + (z - eye[2]) ** 2;
    lists[k].push(thing);
  }
  for (const list of lists) list.sort((a, b) => b.off - a.off);
  return lists;
}
