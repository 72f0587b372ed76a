// Movable regions of a run: the target, and regions with a position.

/**
 * Return the handle of a region at a time [s]: a point of it or of its plane [m, NED]; null if it has none. With
 * `place`, that of the goal at one of its places.
 */
function placeOf(run, index, t, place = null) {
  if (!run.rows || !run.there(index, t)) return null;
  if (index === 0 && run.has("target.x")) return run.vectorHeld("target", t);
  const shape = run.shape(index, t);
  const planes = shape.drawing?.planes?.map(({ point }) => point);
  const handle = surfaceOf(shape)?.center ?? (planes ? Vec.mean(planes) : shape.sight?.feature);
  return handle ? Vec.add(handle, run.shift(index, t, place)) : null;
}

/** Return true if a command may move a region. */
const canMove = (run, index) => index === 0 || run.header.regions[index].moves;

/** Return true if a region has a depth only: all its planes are level. */
const isFlat = (run, index) =>
  run.header.regions[index].shape.drawing?.planes?.every(({ normal: [x, y] }) => x === 0 && y === 0) ?? false;

/** Return the command that moves a region from one point to another [m, NED]. */
function commandToMove(run, index, from, to, t) {
  const radius = run.held("target.radius", t);
  if (index === 0) return { command: "set_target", position: to, radius: radius > 0 ? radius : null };
  return { command: "shift_region", region: run.header.regions[index].name, by: Vec.sub(to, from) };
}
