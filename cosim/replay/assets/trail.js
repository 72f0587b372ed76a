// Path of a vehicle, reduced to the screen's resolution, in chunks that can be hidden one by one.

const FINEST = 2.2; // pixels between points of the line
const CHUNK = 26; // pixels of line that are hidden or visible together

/** Path of one run. */
class Trail {
  constructor(run) {
    this.run = run;
    this._marks = null;
  }

  /** Return the position at a row [m, NED]. */
  _point(row) { return this._columns.map((column) => column[row]); }

  get _columns() { return this.run.columns("position"); }

  /**
   * Return the projected path in chunks.
   * @param {Camera} camera  @param {number} t time that separates past from future [s]
   * @returns {{points: number[][], middle: number[], next: object, past: boolean, active: number}[]} points are pixels;
   * next is the chunk that continues this one, if there is one
   */
  chunks(camera, t) {
    const { run } = this;
    if (!run.rows) return [];
    const [xs, ys, zs] = this._columns;
    const active = run.column("active");
    const now = run.row(t);
    const chunks = [];
    let chunk = null;
    let length = 0;
    let before = null; // pixel
    const add = (p, i, past, last) => {
      const pixel = camera.project(p);
      if (!(pixel[2] > camera.near)) {
        chunk = null; // behind the camera, or not finite
        return;
      }
      const step = chunk ? Math.abs(pixel[0] - before[0]) + Math.abs(pixel[1] - before[1]) : 0;
      const who = active ? active[i] : 0;
      const turns = !chunk || chunk.past !== past || chunk.active !== who;
      if (!turns && !last && step < FINEST) return;
      if (chunk) {
        if (isStraight(chunk.points, pixel)) chunk.points.pop();
        chunk.points.push(pixel);
        length += step;
      }
      if (turns || length > CHUNK) {
        const next = { points: [pixel], middle: p, next: null, past, active: who };
        if (chunk) chunk.next = next;
        chunk = next;
        chunks.push(chunk);
        length = 0;
      }
      before = pixel;
    };
    for (let i = 0; i <= now; i++) add([xs[i], ys[i], zs[i]], i, true, i === 0);
    const here = run.pose(t).position;
    if (t >= run.start) add(here, now, true, true);
    chunk = null;
    add(here, now, false, true);
    for (let i = now + 1; i < run.rows; i++) add([xs[i], ys[i], zs[i]], i, false, i === run.rows - 1);
    return chunks.filter(({ points }) => points.length > 1 && touchesPicture(points, camera));
  }

  /**
   * Return the marks of direction at a spacing [m]: [{row, time, from, middle}], two points of the path each; moves
   * below half the vehicle's radius are ignored.
   */
  marks(spacing) {
    const { run } = this;
    if (this._marks?.spacing === spacing && this._marks.rows === run.rows) return this._marks.list;
    const minStep = 0.5 * run.header.vehicle.radius;
    const list = [];
    let length = 0;
    let from = this._point(0);
    for (let row = 1; row < run.rows; row++) {
      const middle = this._point(row);
      const step = Vec.distance(middle, from);
      if (step < minStep) continue;
      from = middle;
      const before = Math.floor(length / spacing);
      length += Number.isFinite(step) ? step : 0;
      if (Math.floor(length / spacing) === before) continue;
      let k = row; // far enough back for a direction
      while (k > 0 && Vec.distance(middle, this._point(k)) < 0.05 * spacing) k--;
      list.push({ row, time: run.time[row], from: this._point(k), middle });
    }
    this._marks = { spacing, rows: run.rows, list };
    return list;
  }
}

/** Return true if the last point of a line is almost on the segment from the point before it to a new point. */
function isStraight(points, [x, y]) {
  if (points.length < 2) return false;
  const [[x0, y0], [x1, y1]] = points.slice(-2);
  const [u, v, p, q] = [x - x0, y - y0, x1 - x0, y1 - y0];
  return (u - p) * p + (v - q) * q > 0 && Math.abs(u * q - v * p) < 0.25 * Math.hypot(u, v);
}

/** Return true if a line of pixels may touch the picture. */
function touchesPicture(points, { width, height }) {
  const beyond = [([x]) => x < -20, ([x]) => x > width + 20, ([, y]) => y < -20, ([, y]) => y > height + 20];
  return !beyond.some((isBeyond) => points.every(isBeyond));
}

/** Draw a mark of direction: a small arrow head on the path. */
function paintMark(painter, { mark: [x, y, u, v], color, past }) {
  const size = past ? 6.5 : 4.5;
  const corners = [[1, 0], [-0.7, 0.75], [-0.7, -0.75]];
  beginLines(painter.context, corners.map(([a, b]) => [x + size * (a * u - b * v), y + size * (a * v + b * u)]));
  painter.context.closePath();
  if (past) painter.stroke(COLORS.halo, 2.5);
  painter.fill(color);
}
