// Arrows of the forces that act on a vehicle.

/** Forces of a run at a time, scaled for arrows. */
class Forces {
  constructor(run) {
    this.run = run;
    this._rows = 0; // that are evaluated
    this._thrusters = false; // true once any thruster had a force
    this._most = 0; // N, the maximum force on the body
  }

  /**
   * Return the forces at a time [s], one for each thruster; without thruster forces, the force on the body.
   * @returns {{at: number[], force: number[]}[]} body frame: point [m], and force relative to the thruster's limit; the
   * force on the body has length 2 at its greatest
   */
  at(t) {
    this._look();
    const { run } = this;
    if (this._thrusters) {
      return run.header.vehicle.thrusters.map(({ min, max, position, direction }, i) => {
        const force = run.at(`thruster_force[${i + 1}]`, t) / Math.max(Math.abs(min), Math.abs(max));
        return { at: position, force: Vec.scale(direction, force) };
      });
    }
    if (!(this._most > 0)) return [];
    const force = ["X", "Y", "Z"].map((axis) => run.at(`actuation.${axis}`, t));
    return [{ at: [0, 0, 0], force: Vec.scale(force, 2 / this._most) }]; // a single arrow may be twice as long
  }

  _look() {
    const { run } = this;
    const { thrusters: all } = run.header.vehicle;
    const thrusters = all.map((_, i) => run.column(`thruster_force[${i + 1}]`)).filter(Boolean);
    const body = run.columns("actuation", "XYZ").filter(Boolean);
    for (; this._rows < run.rows; this._rows++) {
      this._thrusters ||= thrusters.some((force) => Math.abs(force[this._rows]) > 0);
      this._most = Math.max(this._most, Math.hypot(...body.map((force) => force[this._rows])) || 0);
    }
  }
}

/** Return the lines of an arrow between two pixels; a short one has a smaller head, or none. */
function arrowLines([ax, ay], [bx, by], headLength) {
  const length = Math.hypot(bx - ax, by - ay);
  const shaft = [[ax, ay], [bx, by]];
  if (length < 3) return [shaft];
  const head = Math.min(headLength, 0.6 * length);
  const [ux, uy] = [(bx - ax) / length, (by - ay) / length];
  const end = (side) => [bx - head * (ux + side * uy), by - head * (uy - side * ux)];
  return [shaft, [end(0.6), [bx, by], end(-0.6)]];
}

/** Draw arrows of force: one path of all shafts and heads for the halo, one for the color. */
function paintForces(painter, { pose: { position, R }, size }, forces, radius) {
  const { camera, context } = painter;
  // small vehicles get thinner arrows
  const fine = clamp((size * camera.scaleAt(position)) / 30, 0.6, 1);
  const lines = forces.filter(({ force }) => Vec.norm(force) > 0.02).flatMap(({ at, force }) => {
    const from = Vec.along(position, Vec.turned(R, at), size / radius);
    const [a, b] = [from, Vec.along(from, Vec.turned(R, force), 1.9 * size)].map((p) => camera.project(p));
    return Math.min(a[2], b[2]) > camera.near ? arrowLines(a, b, 7 * fine) : [];
  });
  context.lineCap = "round";
  painter.strokeLines(lines, COLORS.halo, 5 * fine);
  painter.strokeLines(lines, COLORS.thrust, 2.4 * fine);
  context.lineCap = "butt";
}
