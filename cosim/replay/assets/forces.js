// Arrows of the forces that act on a vehicle.

/** Forces of a run at a time, scaled for arrows. */
class Forces {
  constructor(run) {
    this.run = run;
    this._looked = 0; // number of rows that are evaluated
    this._thrusters = false; // true once any thruster had a force
    this._most = 0; // N, the greatest force on the body
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
      return run.header.vehicle.thrusters.map((thruster, i) => {
        const force = run.at(`thruster_force[${i + 1}]`, t);
        const most = Math.max(Math.abs(thruster.min), Math.abs(thruster.max));
        return { at: thruster.position, force: Vec.scale(thruster.direction, force / most) };
      });
    }
    if (!(this._most > 0)) return [];
    const force = ["X", "Y", "Z"].map((axis) => run.at(`actuation.${axis}`, t));
    return [{ at: [0, 0, 0], force: Vec.scale(force, 2 / this._most) }]; // a single arrow may be twice as long
  }

  _look() {
    const { run } = this;
    if (this._looked === run.rows) return;
    const names = run.header.vehicle.thrusters.map((_, i) => `thruster_force[${i + 1}]`);
    const thrusters = names.map((name) => run.column(name)).filter(Boolean);
    const body = ["X", "Y", "Z"].map((axis) => run.column(`actuation.${axis}`));
    for (let k = this._looked; k < run.rows; k++) {
      this._thrusters ||= thrusters.some((force) => Math.abs(force[k]) > 0);
      if (body.every(Boolean)) this._most = Math.max(this._most, Math.hypot(body[0][k], body[1][k], body[2][k]) || 0);
    }
    this._looked = run.rows;
  }
}

/** Add an arrow between two pixels to the path; a short one has a smaller head, or none. */
function addArrow(context, a, b, headLength) {
  context.moveTo(a[0], a[1]);
  context.lineTo(b[0], b[1]);
  const length = Math.hypot(b[0] - a[0], b[1] - a[1]);
  if (length < 3) return;
  const head = Math.min(headLength, 0.6 * length);
  const [ux, uy] = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
  context.moveTo(b[0] - head * (ux + 0.6 * uy), b[1] - head * (uy - 0.6 * ux));
  context.lineTo(b[0], b[1]);
  context.lineTo(b[0] - head * (ux - 0.6 * uy), b[1] - head * (uy + 0.6 * ux));
}

/** Draw arrows of force: one path of all shafts and heads for the halo, one for the color. */
function paintForces(painter, pose, forces, size, real, theme) {
  const { camera, context } = painter;
  const colours = SCENE_THEMES[theme];
  const arrows = [];
  for (const { at, force } of forces) {
    if (!(Vec.norm(force) > 0.02)) continue;
    const from = Vec.along(pose.position, Vec.turned(pose.R, at), size / real);
    const to = Vec.along(from, Vec.turned(pose.R, force), 1.9 * size);
    const [a, b] = [camera.project(from), camera.project(to)];
    if (a[2] > camera.near && b[2] > camera.near) arrows.push([a, b]);
  }
  context.lineCap = "round";
  // small vehicles get thinner arrows
  const fine = Math.min(1, Math.max(0.6, (size * camera.scaleAt(pose.position)) / 30));
  for (const [colour, width] of [[colours.halo, 5 * fine], [colours.thrust, 2.4 * fine]]) {
    context.beginPath();
    for (const [a, b] of arrows) addArrow(context, a, b, 7 * fine);
    painter.stroke(colour, width);
  }
  context.lineCap = "butt";
}
