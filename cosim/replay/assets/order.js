// Who is drawn after whom: planes part the scene, bounded surfaces go by distance, thin things by what hides them.

/**
 * Something that can hide others: a surface or a sheet of a region.
 * @typedef {object} Entry
 * @property {Solid|null} solid  @property {Sheet|null} sheet  @property {number[]} shift [m, NED]
 * @property {object} style  @property {number[]} middle where it is, for its order
 */

/** The point of a chain of points that is nearest to another point. */
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

/** The entries from the farthest to the nearest. Sheets part the others: what is beyond a sheet comes before it. */
function farthestFirst(entries, eye) {
  const sheets = entries.filter((entry) => entry.sheet);
  if (!sheets.length) return entries.map((entry) => [remoteness(entry, eye), entry]).sort((a, b) => b[0] - a[0]).map(([, entry]) => entry);
  const sheet = sheets[0];
  const side = (p) => Vec.dot(Vec.sub(p, sheet.sheet.corners[0]), sheet.sheet.normal) > 0;
  const others = entries.filter((entry) => entry !== sheet);
  const eyeSide = side(eye);
  const beyond = others.filter((entry) => side(entry.middle) !== eyeSide);
  const before = others.filter((entry) => side(entry.middle) === eyeSide);
  return [...farthestFirst(beyond, eye), sheet, ...farthestFirst(before, eye)];
}

/** Of balls that do not touch, the one with less of this never hides behind another: it is their power about the eye. */
function remoteness({ solid, middle }, eye) {
  const off = Vec.sub(middle, eye);
  const radius = solid.ellipsoid ? solid.radius : 0;
  return Vec.dot(off, off) - radius * radius;
}

/** Whether an entry comes between the eye and a point, or holds it. */
function hiddenBy(entry, eye, p) {
  if (entry.sheet) return throughSheet(entry.sheet, eye, p);
  if (!entry.style.filled) return false;
  return entry.solid.hides(Vec.sub(eye, entry.shift), Vec.sub(p, entry.shift));
}

function throughSheet({ corners, normal }, eye, p) {
  const before = Vec.dot(normal, Vec.sub(eye, corners[0]));
  const after = Vec.dot(normal, Vec.sub(p, corners[0]));
  if (before > 0 === after > 0) return false;
  const at = Vec.along(eye, Vec.sub(p, eye), before / (before - after));
  return holds(corners.flat(), corners.map((_, i) => i), at, normal);
}

/**
 * Thin things, put before the first entry, in the order of drawing, that hides them; the last list is before all.
 * @param {Entry[]} entries farthest first  @param {{middle: number[]}[]} things  @returns {object[][]} farthest first each
 */
function placedAmong(entries, things, eye) {
  const lists = Array.from({ length: entries.length + 1 }, () => []);
  for (const thing of things) {
    let k = 0;
    while (k < entries.length && !hiddenBy(entries[k], eye, thing.middle)) k++;
    const [x, y, z] = [thing.middle[0] - eye[0], thing.middle[1] - eye[1], thing.middle[2] - eye[2]];
    thing.off = x * x + y * y + z * z;
    lists[k].push(thing);
  }
  for (const list of lists) list.sort((a, b) => b.off - a.off);
  return lists;
}
