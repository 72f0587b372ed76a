// How large the scene is: where vehicles go and bounded regions are.

/** Whether a region is where it can be met: an obstacle that is not there yet waits far above the water. */
const isThere = (place) => Vec.finite(place) && place[2] > -1e4;

/** Some points of a run's way, and where its regions are on the way. */
function placesOf(run) {
  const places = [];
  const [xs, ys, zs] = ["x", "y", "z"].map((axis) => run.column(`position.${axis}`));
  const stride = Math.max(1, Math.floor(run.rows / 400));
  for (let i = 0; i < run.rows; i += stride) places.push([xs[i], ys[i], zs[i]]);
  if (run.rows) places.push([xs[run.rows - 1], ys[run.rows - 1], zs[run.rows - 1]]);
  const kept = places.filter(Vec.finite);
  const { shape } = run.header.regions[0]; // the goal
  const solid = surfaceOf(shape);
  if (solid && isThere(solid.centre)) {
    const { centre, radius } = solid;
    for (const t of [run.start, run.end]) {
      const at = Vec.add(centre, run.shift(0, t));
      if (Vec.finite(at)) kept.push(at.map((x) => x - radius), at.map((x) => x + radius));
    }
  }
  return kept;
}

/** The upright box about some points. */
function boxAbout(points) {
  return [Math.min, Math.max].map((most) => [0, 1, 2].map((i) => points.reduce((x, p) => most(x, p[i]), points[0][i])));
}

/** The upright box about a surface that is shifted. */
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
 * What of a region belongs into the picture: points. A bounded one counts where it is near the way, along the axes on
 * which it does not go beyond: a pipeline of a kilometre shall not make a vehicle a dot. Of a plane it is the point
 * that is nearest to the way's middle.
 */
function reachOf(shape, shift, way, limits, room) {
  const inLimits = (x, k) => x >= limits[0][k] && x <= limits[1][k];
  const solid = surfaceOf(shape);
  if (solid) {
    if (!isThere(Vec.add(solid.centre, shift))) return [];
    const box = boxOfSolid(solid, shift);
    if (box[0].some((x, k) => x > limits[1][k]) || box[1].some((x, k) => x < limits[0][k])) return [];
    const within = (x, k) => (inLimits(x, k) ? x : Math.min(way[1][k], Math.max(way[0][k], x)));
    return box.map((corner) => corner.map(within));
  }
  const middle = Vec.scale(Vec.add(...way), 0.5);
  return (shape.drawing?.planes ?? [])
    .map(({ point, normal }) => Vec.along(middle, normal, Vec.dot(Vec.sub(Vec.add(point, shift), middle), normal)))
    .filter((p) => p.every((x, k) => x >= limits[0][k] - room && x <= limits[1][k] + room));
}

/**
 * The points that a camera shall have in its picture, and the box in which the scene is drawn.
 * @param {Run[]} runs  @returns {{content: number[][], bounds: [number[], number[]]}}
 */
function extentOf(runs) {
  const places = runs.flatMap(placesOf);
  if (!places.length) places.push([-1, -1, 0], [1, 1, 2]);
  const radius = Math.max(0.1, ...runs.map((run) => run.header.vehicle.radius));
  const [low, high] = boxAbout(places);
  const room = Math.max(6 * radius, 0.35 * Vec.norm(Vec.sub(high, low)));
  const limits = [low.map((x) => x - room), high.map((x) => x + room)];
  const way = [low.map((x) => x - 2 * radius), high.map((x) => x + 2 * radius)];
  const content = [...way];
  for (const run of runs) {
    run.header.regions.forEach((_, i) => {
      for (const t of [run.start, 0.5 * (run.start + run.end), run.end]) {
        content.push(...reachOf(run.shape(i, t), run.rows ? run.shift(i, t) : [0, 0, 0], way, limits, room));
      }
    });
  }
  const bounds = boxAbout(content.filter(Vec.finite));
  const step = roundStep(Math.max(bounds[1][0] - bounds[0][0], bounds[1][1] - bounds[0][1]) / 20);
  for (const axis of [0, 1]) {
    bounds[0][axis] = step * Math.floor(bounds[0][axis] / step);
    bounds[1][axis] = step * Math.ceil(bounds[1][axis] / step);
  }
  // the water's surface tells most where it is near
  const height = bounds[1][2] - bounds[0][2];
  if (bounds[0][2] > 0 && bounds[0][2] < 0.6 * height) bounds[0][2] = 0;
  bounds[1][2] += 0.04 * height;
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [0, 1, 2].map((i) => bounds[(k >> i) & 1][i]));
  return { content: corners, bounds };
}
