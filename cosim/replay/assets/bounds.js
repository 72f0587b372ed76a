// Bounds of the scene, from the paths of the vehicles and from the regions near them.

const ROOM = 0.1; // share of the path's diagonal; regions farther away are not framed

/** Return true if a region is in the scene; an obstacle that is not there yet is parked far above the water. */
const isThere = (place) => Vec.finite(place) && place[2] > -1e4;

/** Return the corners of boxes about the vehicle at sampled rows, and about the goal at start and end, or at each place. */
function placesOf(run) {
  const { radius } = run.header.vehicle;
  const [xs, ys, zs] = ["x", "y", "z"].map((axis) => run.column(`position.${axis}`));
  const stride = Math.max(1, Math.floor(run.rows / 200));
  const rows = Array.from({ length: Math.ceil(run.rows / stride) }, (_, i) => i * stride);
  if (run.rows) rows.push(run.rows - 1);
  const places = rows.map((i) => [xs[i], ys[i], zs[i]]).filter(Vec.finite);
  const kept = places.flatMap((p) => cornersOf([p.map((x) => x - radius), p.map((x) => x + radius)]));
  const { shape, places: inTurn } = run.header.regions[0]; // the goal
  const solid = surfaceOf(shape);
  for (const shift of solid && isThere(solid.centre) ? inTurn ?? [run.start, run.end].map((t) => run.shift(0, t)) : []) {
    const at = Vec.add(solid.centre, shift);
    if (Vec.finite(at)) kept.push(...cornersOf([at.map((x) => x - solid.radius), at.map((x) => x + solid.radius)]));
  }
  return kept;
}

/** Return the eight corners of an axis-aligned box. */
const cornersOf = (box) => [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [0, 1, 2].map((i) => box[(k >> i) & 1][i]));

/** Return the axis-aligned box [low, high] of some points. */
function boxAbout(points) {
  return [Math.min, Math.max].map((most) => [0, 1, 2].map((i) => points.reduce((x, p) => most(x, p[i]), points[0][i])));
}

/** Return the axis-aligned box [low, high] of a shifted surface. */
function boxOfSolid({ points }, shift) {
  const box = [new Array(3).fill(Infinity), new Array(3).fill(-Infinity)];
  for (let k = 0; k < points.length; k++) {
    const x = points[k] + shift[k % 3];
    box[0][k % 3] = Math.min(box[0][k % 3], x);
    box[1][k % 3] = Math.max(box[1][k % 3], x);
  }
  return box;
}

/**
 * Return the points of a region that the camera frames.
 *
 * A bounded region counts where it is near the path, cut to the limits: a long pipeline must not reduce the vehicle to a
 * dot. Of a plane it is the point that is nearest to the middle of the path.
 */
function reachOf(shape, shift, middle, limits) {
  const solid = surfaceOf(shape);
  if (solid) {
    if (!isThere(Vec.add(solid.centre, shift))) return [];
    const box = boxOfSolid(solid, shift);
    if (box[0].some((x, k) => x > limits[1][k]) || box[1].some((x, k) => x < limits[0][k])) return [];
    return cornersOf(box.map((corner) => corner.map((x, k) => Math.min(limits[1][k], Math.max(limits[0][k], x)))));
  }
  return planePoints(shape, shift, middle).filter((p) => p.every((x, k) => x >= limits[0][k] && x <= limits[1][k]));
}

/** Return the points of a region's planes that are nearest to a point. */
function planePoints(shape, shift, middle) {
  const planes = shape.drawing?.planes ?? [];
  return planes.map(({ point, normal }) => Vec.along(middle, normal, Vec.dot(Vec.sub(Vec.add(point, shift), middle), normal)));
}

/**
 * Return the points on the paths, all points that the camera frames, and the box in which everything is drawn.
 * @param {Run[]} runs  @returns {{way: number[][], content: number[][], bounds: [number[], number[]]}} [m, NED]
 */
function extentOf(runs) {
  const way = runs.flatMap(placesOf);
  if (!way.length) way.push([-1, -1, 0], [1, 1, 2]);
  const radius = Math.max(0.1, ...runs.map((run) => run.header.vehicle.radius));
  const [low, high] = boxAbout(way);
  const room = Math.max(4 * radius, ROOM * Vec.norm(Vec.sub(high, low)));
  const limits = [low.map((x) => x - room), high.map((x) => x + room)];
  const middle = Vec.scale(Vec.add(low, high), 0.5);
  const [content, beside] = [[...way], []];
  for (const run of runs) {
    run.header.regions.forEach((_, i) => {
      for (const t of [run.start, 0.5 * (run.start + run.end), run.end]) {
        const [shape, shift] = [run.shape(i, t), run.rows ? run.shift(i, t) : [0, 0, 0]];
        content.push(...reachOf(shape, shift, middle, limits));
        beside.push(...planePoints(shape, shift, middle));
      }
    });
  }
  // a plane that is near widens the bounds, but not what the camera frames
  const near = (p) => p.every((x, k) => x >= low[k] - 2 * room && x <= high[k] + 2 * room);
  const bounds = boxAbout([...content, ...beside.filter(near)].filter(Vec.finite));
  const step = roundStep(Math.max(bounds[1][0] - bounds[0][0], bounds[1][1] - bounds[0][1]) / 20);
  for (const axis of [0, 1]) {
    bounds[0][axis] = step * Math.floor(bounds[0][axis] / step);
    bounds[1][axis] = step * Math.ceil(bounds[1][axis] / step);
  }
  // extend the bounds to the water surface where it is near
  const height = bounds[1][2] - bounds[0][2];
  if (bounds[0][2] > 0 && bounds[0][2] < ROOM * height) bounds[0][2] = 0;
  bounds[1][2] += 0.04 * height;
  return { way, content, bounds };
}
