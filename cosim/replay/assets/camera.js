// Perspective camera: projection of points of the world (north, east, down) to pixels.

const HALF_VIEW = (24 * Math.PI) / 180; // rad, half of the angle of view across the picture's diagonal
const STEEPEST = Math.PI / 2;
const NEARER = 0.8; // share of the distance at which refit() comes nearer to content that has shrunk

/** Perspective camera that orbits a target. Several scenes may share one. */
class Camera {
  constructor() {
    this.target = [0, 0, 0]; // m, NED
    this.azimuth = 2.2; // rad, bearing of the eye from the target
    this.elevation = 0.5; // rad, of the eye above the target
    this.distance = 10; // m
    this.content = []; // points that fit() frames
    this.way = []; // those of them on the vehicles' paths and goals
    this.bearing = 0; // rad, direction of the path
    this.covered = 0; // pixels at the right edge that an overlay covers
    this.listeners = new Set(); // called when the view changes
    this.fitted = true; // true while the view is as fit() left it
    this.width = 1;
    this.height = 1;
    this._update();
  }

  /** Set the size of the picture [CSS pixels]. */
  resize(width, height) {
    if (this.width === width && this.height === height) return;
    this.width = Math.max(1, width);
    this.height = Math.max(1, height);
    if (this.fitted) this.fit();
    else this._update();
  }

  /** Set the width that an overlay covers at the right edge [CSS pixels]. */
  cover(pixels) {
    if (this.covered === pixels) return;
    this.covered = pixels;
    if (this.fitted) this.fit();
  }

  /** Rotate about the target for a drag of dx, dy [CSS pixels]. */
  orbit(dx, dy) {
    this.azimuth += 0.008 * dx;
    this.elevation = Math.min(STEEPEST, Math.max(-STEEPEST, this.elevation + 0.008 * dy));
    this._changed();
  }

  /** Translate the camera so that the scene at the target moves by dx, dy [CSS pixels]. */
  pan(dx, dy) {
    const metres = this.distance / this.focal;
    this.target = Vec.along(Vec.along(this.target, this.right, -dx * metres), this.up, dy * metres);
    this._changed();
  }

  /** Divide the distance to the target by a factor. */
  zoom(factor) {
    this.distance = Math.min(1e6, Math.max(0.2, this.distance / factor));
    this._changed();
  }

  /** Set the target [m, NED] and keep the view direction. */
  aim(target) {
    this.target = [...target];
    this._changed();
  }

  /**
   * Look from a named side and frame all content.
   * @param {"iso"|"top"|"side"|"front"} name iso: oblique, where the path appears longest; top: north is up; side: from
   * east, north to the right; front: towards north, east to the right
   */
  look(name) {
    const views = { top: [Math.PI, STEEPEST], side: [Math.PI / 2, 0], front: [Math.PI, 0] };
    const length = (view) => {
      [this.azimuth, this.elevation] = view;
      this._fit();
      return this._lengthOfWay();
    };
    // oblique: the direction from which the path appears longest
    const [best] = views[name] ? [views[name]] : this._aslant().sort((a, b) => length(b) - length(a));
    [this.azimuth, this.elevation] = best;
    this.fit();
  }

  /** Return the diagonal of the path's bounding box in the picture [pixels]. */
  _lengthOfWay() {
    const seen = this.way.map((p) => this.project(p));
    const extent = (k) => seen.reduce((x, p) => Math.max(x, p[k]), -Infinity) - seen.reduce((x, p) => Math.min(x, p[k]), Infinity);
    return Math.hypot(extent(0), extent(1));
  }

  /** Return oblique directions [azimuth, elevation] [rad] from which the path runs from left to right. */
  _aslant() {
    return [0, Math.PI / 2].flatMap((axis) => {
      const along = axis + (Math.cos(this.bearing - axis) < 0 ? Math.PI : 0);
      return [0.33, 0.55].map((elevation) => [along + 0.5 * Math.PI + 0.42, elevation]);
    });
  }

  /** Frame all content and keep the view direction. */
  fit() {
    this._fit();
    this._changed();
    this.fitted = true;
  }

  /** Frame content that has changed, if the view is as fit() left it; a view that shows it well stays as it is. */
  refit() {
    if (!this.fitted) return;
    const { target, distance } = this;
    const shown = this._showsAll();
    this._fit();
    if (shown && this.distance > NEARER * distance) Object.assign(this, { target, distance });
    this._changed();
    this.fitted = true;
  }

  /** Return true if all content is in the picture, and not behind an overlay. */
  _showsAll() {
    const { side, top, bottom } = this._margins();
    const [left, right] = [0.5 * side, this.width - this.covered - 0.5 * side];
    const [high, low] = [0.5 * top, this.height - 0.5 * bottom];
    return this.content.every((p) => {
      const [x, y, depth] = this.project(p);
      return depth > this.near && x > left && x < right && y > high && y < low;
    });
  }

  /** Return the widths of the picture's edges that fit() leaves empty [CSS pixels]; buttons are at the top. */
  _margins() {
    return { side: Math.min(36, 0.08 * this.width), top: Math.min(50, 0.16 * this.height), bottom: Math.min(28, 0.1 * this.height) };
  }

  _fit() {
    this._update();
    if (!this.content.length) return;
    const { side, top, bottom } = this._margins();
    const tangent = (size, margin) => (0.5 * size - margin) / this.focal;
    const across = this._bounded(this.right, tangent(this.width, side), tangent(this.width, side + this.covered));
    const upright = this._bounded(this.up, tangent(this.height, bottom), tangent(this.height, top));
    const ahead = Vec.dot(this.target, this.forward);
    this.distance = Math.max(across.least, upright.least, 0.5);
    const [right, up] = [across, upright].map(({ middle }) => middle(this.distance));
    this.target = Vec.along(Vec.along(Vec.scale(this.forward, ahead), this.right, right), this.up, up);
    // put the target at the middle depth of the content, since the camera rotates about it
    const depths = this.content.map((p) => Vec.dot(Vec.sub(p, this.target), this.forward));
    const middle = 0.5 * (Math.min(...depths) + Math.max(...depths));
    this.target = Vec.along(this.target, this.forward, middle);
    this.distance += middle;
    this._update();
  }

  /** Return pixels and depth [m] of a point: [x, y, depth]; valid only if depth exceeds `near`. */
  project(p) {
    const [x, y, z] = [p[0] - this.eye[0], p[1] - this.eye[1], p[2] - this.eye[2]];
    const depth = x * this.forward[0] + y * this.forward[1] + z * this.forward[2];
    const k = this.focal / depth;
    return [
      0.5 * this.width + k * (x * this.right[0] + y * this.right[1] + z * this.right[2]),
      0.5 * this.height - k * (x * this.up[0] + y * this.up[1] + z * this.up[2]),
      depth,
    ];
  }

  /** Project `count` points, three numbers each, after a shift [m]; write x, y and depth of each to `out`. */
  projectAll(points, count, shift, out) {
    const [r, u, f] = [this.right, this.up, this.forward];
    const [ex, ey, ez] = Vec.sub(this.eye, shift);
    const [r0, r1, r2, u0, u1, u2, f0, f1, f2] = [...r, ...u, ...f];
    const [cx, cy, focal] = [0.5 * this.width, 0.5 * this.height, this.focal];
    for (let i = 0; i < 3 * count; i += 3) {
      const x = points[i] - ex;
      const y = points[i + 1] - ey;
      const z = points[i + 2] - ez;
      const depth = x * f0 + y * f1 + z * f2;
      const k = focal / depth;
      out[i] = cx + k * (x * r0 + y * r1 + z * r2);
      out[i + 1] = cy - k * (x * u0 + y * u1 + z * u2);
      out[i + 2] = depth;
    }
  }

  /** Return the unit vector from the eye through a pixel. */
  ray(x, y) {
    const right = (x - 0.5 * this.width) / this.focal;
    const up = (0.5 * this.height - y) / this.focal;
    return Vec.unit(Vec.along(Vec.along(this.forward, this.right, right), this.up, up));
  }

  /** Return the scale at a point [pixels/m]. */
  scaleAt(p) {
    return this.focal / Vec.dot(Vec.sub(p, this.eye), this.forward);
  }

  /**
   * Return the least distance from eye to target that frames all content along one axis of the picture.
   *
   * `below` and `above` are tangents of the half angles. `middle` maps a distance to the middle of the content along `side`.
   * Both bounds are linear in the distance, so the solution is closed.
   */
  _bounded(side, below, above) {
    let most = -Infinity;
    let least = Infinity;
    for (const p of this.content) {
      const across = Vec.dot(p, side);
      const ahead = Vec.dot(Vec.sub(p, this.target), this.forward);
      most = Math.max(most, across - above * ahead);
      least = Math.min(least, across + below * ahead);
    }
    return {
      least: (most - least) / (above + below),
      middle: (distance) => 0.5 * (most - above * distance + least + below * distance),
    };
  }

  _changed() {
    this.fitted = false;
    this._update();
    for (const listener of this.listeners) listener();
  }

  _update() {
    const [ca, sa, ce, se] = [
      Math.cos(this.azimuth), Math.sin(this.azimuth), Math.cos(this.elevation), Math.sin(this.elevation),
    ];
    this.forward = [-ce * ca, -ce * sa, se];
    this.right = [sa, -ca, 0];
    this.up = Vec.cross(this.right, this.forward);
    this.eye = Vec.along(this.target, this.forward, -this.distance);
    this.focal = (0.5 * Math.hypot(this.width, this.height)) / Math.tan(HALF_VIEW);
    this.near = Math.min(0.1, 0.02 * this.distance);
  }
}
