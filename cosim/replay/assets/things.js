// Movable regions of a run: the target, and regions with a position.

/**
 * Return the handle of a region at a time [s]: a point of it or of its plane [m, NED]; null if it has none. With `place`,
 * that of the goal at one of its places.
 */
function placeOf(run, index, t, place = null) {
  if (!run.rows || !run.there(index, t)) return null;
  if (index === 0 && run.has("target.x")) return ["x", "y", "z"].map((axis) => run.held(`target.${axis}`, t));
  const shape = run.shape(index, t);
  const shift = run.shift(index, t, place);
  const planes = shape.drawing?.planes;
  const point = surfaceOf(shape)?.centre ?? (planes ? middleOf(planes.map((plane) => plane.point)) : shape.feature);
  return point ? Vec.add(point, shift) : null;
}

/** Return true if a command may move a region. */
function canMove(run, index) {
  return index === 0 || run.header.regions[index].moves;
}

/** Return true if a region has a depth only. */
const isFlat = (run, index) => run.header.regions[index].shape.kind === "depth_band";

/** Return the command that moves a region from one point to another [m, NED]. */
function commandToMove(run, index, from, to, t) {
  if (index === 0) {
    const radius = run.held("target.radius", t);
    return { command: "set_target", position: to, radius: radius > 0 ? radius : null };
  }
  return { command: "shift_region", region: run.header.regions[index].name, by: Vec.sub(to, from) };
}
