// Drawing order: planes split the scene, bounded surfaces are sorted by distance, thin things by what hides them.

/**
 * Entry that can hide others: a surface or a sheet of a region.
 * @typedef {object} Entry
 * @property {Solid|null} solid  @property {Sheet|null} sheet  @property {number[]} shift [m, NED]
 * @property {object} style  @property {number[]} middle position for the order [m, NED]
 */

/** Return the entries from the farthest to the nearest; a sheet separates entries beyond it from those before it. */
function farthestFirst(entries, eye) {
  const plane = entries.find((entry) => entry.sheet);
  if (!plane) return entries.toSorted((a, b) => remoteness(b, eye) - remoteness(a, eye));
  const { corners, normal } = plane.sheet;
  const side = (p) => Vec.dot(Vec.sub(p, corners[0]), normal) > 0;
  const others = entries.filter((entry) => entry !== plane);
  const [beyond, before] = [!side(eye), side(eye)].map((is) => others.filter(({ middle }) => side(middle) === is));
  return [...farthestFirst(beyond, eye), plane, ...farthestFirst(before, eye)];
}

/**
 * Return the sort key of an entry: the power of the eye about its sphere [m^2]; other surfaces count as points.
 *
 * Of two spheres that do not touch, the one with the smaller power is never behind the other.
 */
const remoteness = ({ solid: { ellipsoid, radius }, middle }, eye) =>
  Vec.distance(middle, eye) ** 2 - (ellipsoid ? radius ** 2 : 0);

/** Return a function that is true for points that an entry hides or contains. */
function hiderOf({ solid, sheet, shift, style }, eye) {
  if (sheet) return throughSheet(sheet, eye);
  if (!style.filled) return () => false;
  const hides = solid.from(Vec.sub(eye, shift));
  return (p) => hides(Vec.sub(p, shift));
}

const throughSheet = ({ corners, normal }, eye) => (p) => {
  const [before, after] = [eye, p].map((q) => Vec.dot(normal, Vec.sub(q, corners[0])));
  if (before > 0 === after > 0) return false;
  return holds(corners, Vec.along(eye, Vec.sub(p, eye), before / (before - after)), normal);
};

/** Return thin things in lists: list k is drawn before entry k, the first that hides them; the last list is on top. */
function placedAmong(entries, things, eye) {
  const hiders = entries.map((entry) => hiderOf(entry, eye));
  const lists = Array.from({ length: entries.length + 1 }, () => []);
  for (const thing of things) {
    const first = hiders.findIndex((hides) => hides(thing.middle));
    thing.off = Vec.distance(thing.middle, eye);
    lists.at(first).push(thing); // the last one if none hides it
  }
  for (const list of lists) list.sort((a, b) => b.off - a.off);
  return lists;
}
