// How large the scene is: where vehicles go and bounded regions are.

/** The surface of a shape in space, as it stands in the scenario; one object for each shape, made once. */
const SURFACES = new WeakMap();

function surfaceOf(shape) {
  if (!SURFACES.has(shape)) SURFACES.set(shape, SOLIDS[shape.kind](shape));
  return SURFACES.get(shape);
}

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
  if (SOLIDS[shape.kind]) {
    const { centre, radius } = surfaceOf(shape);
    for (const t of [run.start, run.end]) {
      const at = Vec.add(centre, run.shift(0, t));
      if (Vec.finite(at)) for (const k of [-1, 1]) for (let i = 0; i < 3; i++) kept.push(at.map((x, j) => x + (i === j ? k * radius : 0)));
    }
  }
  return kept;
}

/** The upright box about some points. */
function boxAbout(points) {
  return [Math.min, Math.max].map((most) => [0, 1, 2].map((i) => points.reduce((x, p) => most(x, p[i]), points[0][i])));
}

/**
 * The points that a camera shall have in its picture, and the box in which the scene is drawn.
 * Regions count as far as they are near the way: a pipeline of a kilometre shall not make a vehicle a dot.
 * @param {Run[]} runs  @returns {{content: number[][], bounds: [number[], number[]]}}
 */
function extentOf(runs) {
  const places = runs.flatMap(placesOf);
  if (!places.length) places.push([-1, -1, 0], [1, 1, 2]);
  const radius = Math.max(0.1, ...runs.map((run) => run.header.vehicle.radius));
  const [low, high] = boxAbout(places);
  const room = Math.max(6 * radius, 0.35 * Math.hypot(...Vec.sub(high, low)));
  const limits = [low.map((x) => x - room), high.map((x) => x + room)];
  const content = [low.map((x) => x - 2 * radius), high.map((x) => x + 2 * radius)];
  const within = (p) => p.map((x, i) => Math.min(limits[1][i], Math.max(limits[0][i], x)));
  for (const run of runs) {
    run.header.regions.forEach((region, i) => {
      for (const t of [run.start, 0.5 * (run.start + run.end), run.end]) {
        const [shape, shift] = [run.shape(i, t), run.rows ? run.shift(i, t) : [0, 0, 0]];
        if (SOLIDS[shape.kind]) {
          const { points, centre } = surfaceOf(shape);
          if (!isThere(Vec.add(centre, shift))) continue;
          const corners = [[], []];
          for (let axis = 0; axis < 3; axis++) {
            for (let k = axis; k < points.length; k += 3) {
              corners[0][axis] = Math.min(corners[0][axis] ?? Infinity, points[k] + shift[axis]);
              corners[1][axis] = Math.max(corners[1][axis] ?? -Infinity, points[k] + shift[axis]);
            }
          }
          if (corners[0].every((x, k) => x < limits[1][k]) && corners[1].every((x, k) => x > limits[0][k])) content.push(...corners.map(within));
        } else if (PLANES[shape.kind]) {
          // the point of the plane that is nearest to the middle, so that the plane is in the picture
          const middle = Vec.scale(Vec.add(low, high), 0.5);
          for (const { point, normal } of PLANES[shape.kind](shape)) {
            const off = Vec.dot(Vec.sub(Vec.add(point, shift), middle), normal);
            const nearest = Vec.along(middle, normal, off);
            if (nearest.every((x, k) => x >= limits[0][k] - room && x <= limits[1][k] + room)) content.push(nearest);
          }
        }
      }
    });
  }
  const [a, b] = boxAbout(content);
  const step = roundStep(Math.max(b[0] - a[0], b[1] - a[1]) / 20);
  const outward = (x, i, sign) => (i < 2 ? step * (sign > 0 ? Math.ceil(x / step) : Math.floor(x / step)) : x);
  const bounds = [a.map((x, i) => outward(x, i, -1)), b.map((x, i) => outward(x, i, 1))];
  // the water's surface tells most where it is near
  const height = bounds[1][2] - bounds[0][2];
  if (bounds[0][2] > 0 && bounds[0][2] < 0.6 * height) bounds[0][2] = 0;
  bounds[1][2] += 0.04 * height;
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [0, 1, 2].map((i) => bounds[(k >> i) & 1][i]));
  return { content: corners, bounds };
}
