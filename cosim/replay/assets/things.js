// What can be moved in a live run: the target, and regions that are at a place.

/** The point of a region, or of its plane, by which it is taken, at a time [m, NED]; null for one that is nowhere. */
function placeOf(run, index, t) {
  if (!run.rows || !run.there(index, t)) return null;
  if (index === 0 && run.has("target.x")) return ["x", "y", "z"].map((axis) => run.held(`target.${axis}`, t));
  const shape = run.shape(index, t);
  const shift = run.shift(index, t);
  const planes = shape.drawing?.planes;
  const point = surfaceOf(shape)?.centre ?? (planes ? middleOf(planes.map((plane) => plane.point)) : shape.feature);
  return point ? Vec.add(point, shift) : null;
}

/** Whether a region may be moved by an order. */
function canMove(run, index) {
  return index === 0 || run.header.regions[index].moves;
}

/** Whether only its depth matters. */
const isFlat = (run, index) => run.header.regions[index].shape.kind === "depth_band";

/** The order that moves a region so that its place goes from one point to another. */
function commandToMove(run, index, from, to, t) {
  if (index === 0) {
    const radius = run.held("target.radius", t);
    return { command: "set_target", position: to, radius: radius > 0 ? radius : null };
  }
  return { command: "shift_region", region: run.header.regions[index].name, by: Vec.sub(to, from) };
}
