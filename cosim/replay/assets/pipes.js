// A pipe's surface: tubes that meet in their bisecting planes inside a bend, and in a part of a ball outside it.

const CAP_RINGS = 6;
const TURN_RINGS = 5;

/** The surface of a pipe, whose g is the distance to its line: round ends, round joints. */
function pipeOf({ points, radius }) {
  const pieces = points.slice(1).map((p, i) => Vec.unit(Vec.sub(p, points[i])));
  let [first, second] = Vec.aside(pieces[0]);
  const rings = [];
  // from the pole to the first tube
  for (let k = 1; k <= CAP_RINGS; k++) {
    const angle = (0.5 * Math.PI * k) / CAP_RINGS;
    const centre = Vec.along(points[0], pieces[0], -radius * Math.cos(angle));
    rings.push(ring(centre, first, second, radius * Math.sin(angle)));
  }
  for (let j = 1; j < pieces.length; j++) {
    const [before, after] = [pieces[j - 1], pieces[j]];
    const turn = Math.atan2(Vec.norm(Vec.cross(before, after)), Vec.dot(before, after));
    if (turn < 1e-6) {
      rings.push(ring(points[j], first, second, radius));
      continue;
    }
    const inner = Vec.unit(Vec.sub(after, Vec.scale(before, Vec.dot(before, after)))); // where the bend is tight
    const axis = Vec.cross(before, inner);
    for (let k = 0; k <= TURN_RINGS; k++) {
      const part = (turn * k) / TURN_RINGS;
      rings.push(ring([0, 0, 0], first, second, radius).map((d) => {
        const tight = Vec.dot(d, inner);
        if (tight > 0) {
          // cut by the bisecting plane, the same point for all k
          return Vec.along(Vec.add(points[j], d), before, -tight * Math.tan(0.5 * turn));
        }
        return Vec.add(points[j], rotatedAbout(axis, part, d));
      }));
    }
    [first, second] = [rotatedAbout(axis, turn, first), rotatedAbout(axis, turn, second)];
  }
  const end = pieces[pieces.length - 1];
  for (let k = CAP_RINGS; k >= 1; k--) {
    const angle = (0.5 * Math.PI * k) / CAP_RINGS;
    const centre = Vec.along(points[points.length - 1], end, radius * Math.cos(angle));
    rings.push(ring(centre, first, second, radius * Math.sin(angle)));
  }
  const surface = [Vec.along(points[0], pieces[0], -radius), ...rings.flat()];
  surface.push(Vec.along(points[points.length - 1], end, radius));
  const faces = Array.from({ length: AROUND }, (_, i) => [0, 1 + ((i + 1) % AROUND), 1 + i]);
  for (let k = 1; k < rings.length; k++) faces.push(...bandFaces(1 + (k - 1) * AROUND, 1 + k * AROUND, AROUND));
  const last = 1 + (rings.length - 1) * AROUND;
  for (let i = 0; i < AROUND; i++) faces.push([last + i, last + ((i + 1) % AROUND), surface.length - 1]);
  const solid = solidOf(...welded(surface, faces));
  solid.spine = points;
  solid.shadows = points.slice(1).map((p, i) => {
    const discs = [points[i], p].map((centre) => ring(centre, [1, 0, 0], [0, 1, 0], radius));
    return outlineFromAbove(discs.flat());
  });
  const meets = (eye, p) => points.some((a, i) => i > 0 && segmentsWithin(points[i - 1], a, p, eye, radius));
  solid.from = (eye) => (x, y, z) => nearSight(solid, eye, x, y, z) && meets(eye, [x, y, z]);
  return solid;
}

/** The same surface with one point where several were: rings of a bend meet on its tight side. */
function welded(points, faces) {
  const known = new Map();
  const kept = [];
  const index = points.map((p) => {
    const key = p.map((x) => x.toFixed(9)).join();
    if (!known.has(key)) {
      known.set(key, kept.length);
      kept.push(p);
    }
    return known.get(key);
  });
  const thinned = faces.map((face) => {
    const own = face.map((i) => index[i]);
    return own.filter((k, i) => k !== own[(i + 1) % own.length]);
  });
  return [kept, thinned.filter((face) => face.length > 2)];
}

/** A vector turned about a unit axis by an angle [rad], after Rodrigues. */
function rotatedAbout(axis, angle, v) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const turned = Vec.along(Vec.scale(v, c), Vec.cross(axis, v), s);
  return Vec.along(turned, axis, Vec.dot(axis, v) * (1 - c));
}

/** Whether two segments, from a to b and from c to d, come nearer to each other than a distance. */
function segmentsWithin(a, b, c, d, distance) {
  const [u, v, w] = [Vec.sub(b, a), Vec.sub(d, c), Vec.sub(a, c)];
  const [uu, uv, vv, uw, vw] = [Vec.dot(u, u), Vec.dot(u, v), Vec.dot(v, v), Vec.dot(u, w), Vec.dot(v, w)];
  const clamp = (x) => Math.min(1, Math.max(0, x));
  const across = uu * vv - uv * uv;
  let s = across > 1e-12 * uu * vv ? clamp((uv * vw - vv * uw) / across) : 0;
  const t = vv > 0 ? clamp((uv * s + vw) / vv) : 0;
  s = clamp((uv * t - uw) / uu);
  return Vec.norm(Vec.along(Vec.along(w, u, s), v, -t)) < distance;
}
