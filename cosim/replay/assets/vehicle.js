// The vehicle: a schematic hull of its size, not its likeness. The yellow floats are on top, the dome is the nose.

/** Faces of the hull for a radius of 1, body axes: forward, starboard, down. */
const HULL = hullFaces();

function hullFaces() {
  const faces = [];
  const add = (colour, points, polygons) => {
    for (const polygon of polygons) {
      const corners = polygon.map((i) => points[i]);
      const middle = corners.reduce((sum, p) => Vec.along(sum, p, 1 / corners.length), [0, 0, 0]);
      faces.push({ colour, corners, middle, normal: normalOf(corners) });
    }
  };
  /** A profile, forward and down, pulled from one side to the other. */
  const pulled = (colour, profile, from, to) => {
    const n = profile.length;
    const points = [from, to].flatMap((y) => profile.map(([x, z]) => [x, y, z]));
    const around = profile.map((_, i) => i);
    add(colour, points, [
      ...around.map((i) => [i, i + n, ((i + 1) % n) + n, (i + 1) % n]),
      around,
      around.map((i) => n + i).reverse(),
    ]);
  };
  const bar = (colour, [x, y, z], [a, b, c]) =>
    pulled(colour, [[x + a, z - c], [x - a, z - c], [x - a, z + c], [x + a, z + c]].reverse(), y - b, y + b);

  for (const side of [-1, 1]) {
    const [inner, outer] = side < 0 ? [-0.76, -0.2] : [0.2, 0.76];
    const float = [[0.98, -0.36], [0.8, -0.68], [-0.86, -0.68], [-0.98, -0.52], [-0.98, -0.24], [0.9, -0.24]];
    pulled("float", [...float].reverse(), inner, outer);
    for (const x of [-0.78, 0.7]) bar("frame", [x, 0.7 * side, 0.16], [0.06, 0.05, 0.42]);
    bar("skid", [-0.02, 0.7 * side, 0.62], [0.98, 0.07, 0.06]);
  }
  for (const x of [-0.78, 0.7]) bar("frame", [x, 0, 0.5], [0.05, 0.66, 0.05]);

  const around = 12;
  const circle = (x, radius) =>
    Array.from({ length: around }, (_, i) => {
      const angle = (2 * Math.PI * i) / around;
      return [x, radius * Math.cos(angle), 0.12 + radius * Math.sin(angle)];
    });
  const band = (k) =>
    Array.from({ length: around }, (_, i) => {
      const next = (i + 1) % around;
      return [k * around + i, k * around + next, (k + 1) * around + next, (k + 1) * around + i];
    });
  add("tube", [...circle(-0.8, 0.3), ...circle(0.66, 0.3)], [...band(0), Array.from({ length: around }, (_, i) => around - 1 - i)]);
  const nose = [...circle(0.66, 0.3), ...circle(0.84, 0.25), ...circle(0.95, 0.14), [0.98, 0, 0.12]];
  const tip = Array.from({ length: around }, (_, i) => [2 * around + i, 2 * around + ((i + 1) % around), 3 * around]);
  add("dome", nose, [...band(0), ...band(1), ...tip]);
  return faces;
}

/** What a run says of forces at a time, for arrows. */
class Forces {
  constructor(run) {
    this.run = run;
    this._looked = 0; // rows that are known
    this._thrusters = false; // whether any thruster ever gave anything
    this._most = 0; // N, the greatest force on the body
  }

  /** @returns {{name: string, at: number[], force: number[]}[]} body frame; a force of length 1 is the greatest there is */
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
    return [{ at: [0, 0, 0], force: Vec.scale(force, 2 / this._most) }]; // one arrow has room to be twice as long
  }

  _look() {
    const { run } = this;
    if (this._looked === run.rows) return;
    const thrusters = run.header.vehicle.thrusters.map((_, i) => run.column(`thruster_force[${i + 1}]`)).filter(Boolean);
    const body = ["X", "Y", "Z"].map((axis) => run.column(`actuation.${axis}`));
    for (let k = this._looked; k < run.rows; k++) {
      this._thrusters ||= thrusters.some((force) => Math.abs(force[k]) > 0);
      if (body.every(Boolean)) this._most = Math.max(this._most, Math.hypot(body[0][k], body[1][k], body[2][k]) || 0);
    }
    this._looked = run.rows;
  }
}

const SHADES = new Map();

/** A colour of the hull in one of eight steps of light. */
function shaded(colour, light) {
  const step = Math.round(7 * Math.min(1, Math.max(0, light)));
  const key = `${colour} ${step}`;
  if (!SHADES.has(key)) {
    const part = step / 7;
    SHADES.set(key, part < 0.6 ? mixedColour(colour, "#0a141b", 0.62 * (0.6 - part)) : mixedColour(colour, "#ffffff", 0.5 * (part - 0.6)));
  }
  return SHADES.get(key);
}

/** The hull's faces that look at the eye, in the world: [{corners, middle, colour}]. */
function hullAt({ position, R }, size, eye, theme) {
  const seen = [];
  for (const face of HULL) {
    const middle = Vec.along(position, Vec.turned(R, face.middle), size);
    const normal = Vec.turned(R, face.normal);
    if (Vec.dot(normal, Vec.sub(eye, middle)) <= 0) continue;
    // light from above, and a little from where one looks
    const light = 0.52 - 0.4 * normal[2] + 0.12 * normal[0];
    const corners = face.corners.map((p) => Vec.along(position, Vec.turned(R, p), size));
    seen.push({ corners, middle, colour: shaded(SCENE_THEMES[theme].hull[face.colour], light) });
  }
  return seen;
}

/** Rings where the thrusters are, and struts to those outside of the hull. */
function paintThrusters(painter, pose, thrusters, size, real, colour) {
  painter.begin();
  for (const { position, direction } of thrusters) {
    const at = Vec.along(pose.position, Vec.turned(pose.R, position), size / real);
    const axis = Vec.turned(pose.R, Vec.unit(direction));
    const rim = rimOf(at, axis, 0.5 * Math.PI, 0.2 * size);
    for (let i = 0; i < rim.length; i += 3) painter.segment(rim[i], rim[(i + 3) % rim.length]);
    const off = Vec.norm(position) / real;
    if (off > 1.15) painter.segment(Vec.along(pose.position, Vec.turned(pose.R, position), (0.8 * size) / (off * real)), at);
  }
  painter.stroke(colour, 1.3, 0.9);
}

/** Arrows of force, all in one path for the shafts and one for the heads. */
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
  for (const [colour, width] of [[colours.halo, 5], [colours.thrust, 2.4]]) {
    context.beginPath();
    for (const [a, b] of arrows) {
      context.moveTo(a[0], a[1]);
      context.lineTo(b[0], b[1]);
      const length = Math.hypot(b[0] - a[0], b[1] - a[1]);
      if (length < 3) continue;
      const head = Math.min(7, 0.6 * length);
      const [ux, uy] = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
      context.moveTo(b[0] - head * (ux + 0.6 * uy), b[1] - head * (uy - 0.6 * ux));
      context.lineTo(b[0], b[1]);
      context.lineTo(b[0] - head * (ux - 0.6 * uy), b[1] - head * (uy + 0.6 * ux));
    }
    painter.stroke(colour, width);
  }
  context.lineCap = "butt";
}

/** The body's axes: forward, starboard, down. */
function paintBodyAxes(painter, pose, size, theme) {
  const { context, camera } = painter;
  const { ink } = SCENE_THEMES[theme];
  [["x", 2.3], ["y", 1.7], ["z", 1.7]].forEach(([name, length], i) => {
    const axis = [pose.R[i], pose.R[3 + i], pose.R[6 + i]];
    const tip = Vec.along(pose.position, axis, length * size);
    painter.begin();
    painter.segment(Vec.along(pose.position, axis, (i ? 0.8 : 1) * size), tip);
    painter.stroke(ink, i ? 1 : 2, 0.75);
    const [x, y, depth] = camera.project(Vec.along(pose.position, axis, (length + 0.25) * size));
    if (depth < camera.near || length * size * camera.scaleAt(tip) < 26) return;
    context.fillStyle = ink;
    context.font = "italic 11px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillText(name, x, y);
  });
}
