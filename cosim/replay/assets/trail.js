// Path of a vehicle, reduced to the screen's resolution, in chunks that can be hidden one by one.

const FINEST = 2.2; // pixels between points of the line
const CHUNK = 26; // pixels of line that are hidden or visible together

/** Path of one run. */
class Trail {
  constructor(run) {
    this.run = run;
    this._way = new Float64Array(0); // m, path length at each row
    this._known = 0;
    this._marks = null;
  }

  /**
   * Return the projected path in chunks.
   * @param {Camera} camera  @param {number} t time that separates past from future [s]
   * @returns {{points: number[], middle: number[], next: object, past: boolean, active: number}[]} points are pixels, x and
   * y in turn; next is the chunk that continues this one, if there is one
   */
  chunks(camera, t) {
    const { run } = this;
    const chunks = [];
    if (!run.rows) return chunks;
    const [xs, ys, zs] = ["x", "y", "z"].map((axis) => run.column(`position.${axis}`));
    const active = run.column("active");
    const now = run.row(t);
    const [e, r, u, f] = [camera.eye, camera.right, camera.up, camera.forward];
    const { near, focal, width, height } = camera;
    let chunk = null;
    let length = 0;
    let [lastX, lastY] = [0, 0];
    const add = (x, y, z, i, past, last) => {
      const [dx, dy, dz] = [x - e[0], y - e[1], z - e[2]];
      const depth = dx * f[0] + dy * f[1] + dz * f[2];
      if (!(depth > near)) {
        chunk = null; // behind the camera, or not finite
        return;
      }
      const k = focal / depth;
      const px = 0.5 * width + k * (dx * r[0] + dy * r[1] + dz * r[2]);
      const py = 0.5 * height - k * (dx * u[0] + dy * u[1] + dz * u[2]);
      const step = chunk ? Math.abs(px - lastX) + Math.abs(py - lastY) : 0;
      const who = active ? active[i] : 0;
      const turns = !chunk || chunk.past !== past || chunk.active !== who;
      if (!turns && !last && step < FINEST) return;
      if (chunk) {
        if (straight(chunk.points, px, py)) chunk.points.length -= 2;
        chunk.points.push(px, py);
        length += step;
      }
      if (turns || length > CHUNK) {
        const before = chunk;
        const points = before ? before.points.slice(-2) : [px, py];
        chunk = { points, middle: [x, y, z], next: null, past, active: who };
        if (before) before.next = chunk;
        chunks.push(chunk);
        length = 0;
      }
      [lastX, lastY] = [px, py];
    };
    for (let i = 0; i <= now; i++) add(xs[i], ys[i], zs[i], i, true, i === 0);
    const here = run.pose(t).position;
    if (t >= run.start) add(...here, now, true, true);
    chunk = null;
    add(...here, now, false, true);
    for (let i = now + 1; i < run.rows; i++) add(xs[i], ys[i], zs[i], i, false, i === run.rows - 1);
    return chunks.filter((c) => c.points.length > 2 && inPicture(c.points, width, height));
  }

  /** Return the path length at each row [m]; moves below half the vehicle's radius are ignored. */
  way() {
    const { run } = this;
    if (this._way.length < run.rows) {
      const longer = new Float64Array(2 * run.rows);
      longer.set(this._way.subarray(0, this._known));
      this._way = longer;
    }
    const [xs, ys, zs] = ["x", "y", "z"].map((axis) => run.column(`position.${axis}`));
    const least = 0.5 * run.header.vehicle.radius;
    for (let i = this._known; i < run.rows; i++) {
      if (i === 0) this._from = [xs[0], ys[0], zs[0]];
      const moved = Math.hypot(xs[i] - this._from[0], ys[i] - this._from[1], zs[i] - this._from[2]);
      this._way[i] = i ? this._way[i - 1] : 0;
      if (!(moved < least) && i) {
        this._way[i] += Number.isFinite(moved) ? moved : 0;
        this._from = [xs[i], ys[i], zs[i]];
      }
    }
    this._known = run.rows;
    return this._way;
  }

  /** Return the marks of direction at a spacing [m]: [{row, time, from, middle}], two points of the path each. */
  marks(spacing) {
    const { run } = this;
    if (this._marks?.spacing === spacing && this._marks.rows === run.rows) return this._marks.list;
    const way = this.way();
    const { time } = run;
    const [xs, ys, zs] = ["x", "y", "z"].map((axis) => run.column(`position.${axis}`));
    const list = [];
    for (let i = 1; i < run.rows; i++) {
      if (Math.floor(way[i] / spacing) <= Math.floor(way[i - 1] / spacing)) continue;
      const middle = [xs[i], ys[i], zs[i]];
      let k = i; // far enough back for a direction
      while (k > 0 && Math.hypot(middle[0] - xs[k], middle[1] - ys[k], middle[2] - zs[k]) < 0.05 * spacing) k--;
      list.push({ row: i, time: time[i], from: [xs[k], ys[k], zs[k]], middle });
    }
    this._marks = { spacing, rows: run.rows, list };
    return list;
  }
}

/** Return true if the last point of a line is almost on the segment from the point before it to a new point. */
function straight(points, x, y) {
  const n = points.length;
  if (n < 4) return false;
  const [u, v] = [x - points[n - 4], y - points[n - 3]];
  const [p, q] = [points[n - 2] - points[n - 4], points[n - 1] - points[n - 3]];
  return (u - p) * p + (v - q) * q > 0 && Math.abs(u * q - v * p) < 0.25 * Math.hypot(u, v);
}

/** Return true if a line of pixels may touch the picture. */
function inPicture(points, width, height) {
  let [left, right, top, bottom] = [true, true, true, true];
  for (let i = 0; i < points.length; i += 2) {
    left &&= points[i] < -20;
    right &&= points[i] > width + 20;
    top &&= points[i + 1] < -20;
    bottom &&= points[i + 1] > height + 20;
  }
  return !(left || right || top || bottom);
}

/** Draw a mark of direction: a small arrow head on the path. */
function paintMark(painter, { mark: [x, y, u, v], colour, past }, colours) {
  const { context } = painter;
  const size = past ? 6.5 : 4.5;
  context.beginPath();
  context.moveTo(x + size * u, y + size * v);
  context.lineTo(x - size * (0.7 * u + 0.75 * v), y - size * (0.7 * v - 0.75 * u));
  context.lineTo(x - size * (0.7 * u - 0.75 * v), y - size * (0.7 * v + 0.75 * u));
  context.closePath();
  if (past) painter.stroke(colours.halo, 2.5);
  painter.fill(colour);
}
