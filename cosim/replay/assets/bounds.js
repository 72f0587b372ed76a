// Bounds of the scene, from the paths of the vehicles and from the regions near them.

const ROOM = 0.1; // share of the path's diagonal; regions farther away are not framed

/** Return true if a region is in the scene; an obstacle that is not there yet is parked far above the water. */
const isThere = (place) => Vec.finite(place) && place[2] > -1e4;

/** Return the eight corners of an axis-aligned box. */
const cornersOf = (box) => [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [0, 1, 2].map((i) => box[(k >> i) & 1][i]));

/** Return a box [low, high] that is widened by a margin. */
const widenedBox = ([low, high], by) => [low.map((x) => x - by), high.map((x) => x + by)];

const isInBox = (p, [low, high]) => p.every((x, i) => x >= low[i] && x <= high[i]);

/** Return corners of boxes about the vehicle at sampled rows, and about the goal at start and end, or each place. */
function placesOf(run) {
  const columns = run.columns("position");
  const stride = Math.max(1, Math.floor(run.rows / 200));
  const rows = [...run.time.keys()].filter((i) => i % stride === 0 || i === run.rows - 1);
  const { radius } = run.header.vehicle;
  const balls = rows.map((i) => ({ center: columns.map((column) => column[i]), radius }));
  const { shape, places } = run.header.regions[0]; // the goal
  const solid = surfaceOf(shape);
  if (solid && isThere(solid.center)) {
    const shifts = places ?? [run.start, run.end].map((t) => run.shift(0, t));
    balls.push(...shifts.map((shift) => ({ center: Vec.add(solid.center, shift), radius: solid.radius })));
  }
  const shown = balls.filter(({ center }) => Vec.finite(center));
  return shown.flatMap(({ center, radius: r }) => cornersOf(widenedBox([center, center], r)));
}

/**
 * Return the points of a region that the camera frames.
 *
 * A bounded region counts where it is near the path, cut to the limits: a long pipeline must not reduce the vehicle
 * to a dot. Of a plane it is the point that is nearest to the middle of the path.
 */
function reachOf(shape, shift, middle, limits) {
  const solid = surfaceOf(shape);
  if (!solid) return planePoints(shape, shift, middle).filter((p) => isInBox(p, limits));
  if (!isThere(Vec.add(solid.center, shift))) return [];
  const [low, high] = boxAbout(solid.points).map((corner) => Vec.add(corner, shift));
  if (low.some((x, k) => x > limits[1][k]) || high.some((x, k) => x < limits[0][k])) return [];
  return cornersOf([low, high].map((corner) => corner.map((x, k) => clamp(x, limits[0][k], limits[1][k]))));
}

/** Return the points of a region's planes that are nearest to a point. */
const planePoints = (shape, shift, middle) => (shape.drawing?.planes ?? []).map(({ point, normal }) =>
  Vec.along(middle, normal, Vec.dot(Vec.sub(Vec.add(point, shift), middle), normal)));

/**
 * Return the points on the paths, all points that the camera frames, and the box in which everything is drawn.
 * @param {Run[]} runs  @returns {{way: number[][], content: number[][], bounds: [number[], number[]]}} [m, NED]
 */
function extentOf(runs) {
  const way = runs.flatMap(placesOf);
  if (!way.length) way.push([-1, -1, 0], [1, 1, 2]);
  const radius = Math.max(0.1, ...runs.map((run) => run.header.vehicle.radius));
  const box = boxAbout(way);
  const room = Math.max(4 * radius, ROOM * Vec.distance(...box));
  const [limits, middle] = [widenedBox(box, room), Vec.mean(box)];
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
  const near = beside.filter((p) => isInBox(p, widenedBox(box, 2 * room)));
  const [low, high] = boxAbout([...content, ...near].filter(Vec.finite));
  const step = roundStep(Math.max(high[0] - low[0], high[1] - low[1]) / 20);
  for (const axis of [0, 1]) {
    low[axis] = step * Math.floor(low[axis] / step);
    high[axis] = step * Math.ceil(high[axis] / step);
  }
  // extend the bounds to the water surface where it is near
  const height = high[2] - low[2];
  if (low[2] > 0 && low[2] < ROOM * height) low[2] = 0;
  high[2] += 0.04 * height;
  return { way, content, bounds: [low, high] };
}
