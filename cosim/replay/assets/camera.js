// Perspective camera: projection of points of the world (north, east, down) to pixels.

const HALF_VIEW = (24 * Math.PI) / 180; // rad, half of the angle of view across the picture's diagonal
const STEEPEST = Math.PI / 2;
const NEARER = 0.8; // share of the distance at which refit() comes nearer to content that has shrunk
const VIEWS = { top: [Math.PI, STEEPEST], side: [Math.PI / 2, 0], front: [Math.PI, 0] }; // azimuth, elevation [rad]

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
    Object.assign(this, { width, height });
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
    this.elevation = clamp(this.elevation + 0.008 * dy, -STEEPEST, STEEPEST);
    this._changed();
  }

  /** Translate the camera so that the scene at the target moves by dx, dy [CSS pixels]. */
  pan(dx, dy) {
    const meters = this.distance / this.focal;
    this.aim(Vec.along(Vec.along(this.target, this.right, -dx * meters), this.up, dy * meters));
  }

  /** Divide the distance to the target by a factor. */
  zoom(factor) {
    this.distance = clamp(this.distance / factor, 0.2, 1e6);
    this._changed();
  }

  /** Set the target [m, NED] and keep the view direction. */
  aim(target) {
    this.target = target;
    this._changed();
  }

  /**
   * Look from a named side and frame all content.
   * @param {"iso"|"top"|"side"|"front"} name iso: oblique, where the path appears longest; top: north is up; side: from
   * east, north to the right; front: towards north, east to the right
   */
  look(name) {
    const length = (view) => {
      [this.azimuth, this.elevation] = view;
      this._fit();
      const [low, high] = boxAbout(this.way.map((p) => this.project(p)));
      return Math.hypot(high[0] - low[0], high[1] - low[1]);
    };
    const views = VIEWS[name] ? [VIEWS[name]] : this._aslant();
    if (views.length > 1 && this.way.length) views.sort((a, b) => length(b) - length(a));
    [this.azimuth, this.elevation] = views[0];
    this.fit();
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
    const complete = this._showsAll();
    this._fit();
    if (complete && this.distance > NEARER * distance) Object.assign(this, { target, distance });
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
    const { width, height } = this;
    return { side: Math.min(36, 0.08 * width), top: Math.min(50, 0.16 * height), bottom: Math.min(28, 0.1 * height) };
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

  /**
   * Return the minimum distance from eye to target that frames all content along one axis of the picture.
   *
   * `below` and `above` are tangents of the half angles. `middle` maps a distance to the middle of the content along
   * `side`. Both bounds are linear in the distance, so the solution is closed.
   */
  _bounded(side, below, above) {
    const points = this.content.map((p) => [Vec.dot(p, side), Vec.dot(Vec.sub(p, this.target), this.forward)]);
    const upper = Math.max(...points.map(([across, ahead]) => across - above * ahead));
    const lower = Math.min(...points.map(([across, ahead]) => across + below * ahead));
    return {
      least: (upper - lower) / (above + below),
      middle: (distance) => 0.5 * (upper - above * distance + lower + below * distance),
    };
  }

  /** Return pixels and depth [m] of a point: [x, y, depth]; valid only if depth exceeds `near`. */
  project(p) {
    const { right, up, forward, eye } = this;
    const [x, y, z] = [p[0] - eye[0], p[1] - eye[1], p[2] - eye[2]];
    const depth = x * forward[0] + y * forward[1] + z * forward[2];
    const scale = this.focal / depth;
    return [
      0.5 * this.width + scale * (x * right[0] + y * right[1] + z * right[2]),
      0.5 * this.height - scale * (x * up[0] + y * up[1] + z * up[2]),
      depth,
    ];
  }

  /** Return true if a projected point is before the camera and in the picture. */
  isInPicture([x, y, depth]) {
    return depth > this.near && x > 0 && y > 0 && x < this.width && y < this.height;
  }

  /** Return the unit vector from the eye through a pixel. */
  ray(x, y) {
    const right = (x - 0.5 * this.width) / this.focal;
    const up = (0.5 * this.height - y) / this.focal;
    return Vec.unit(Vec.along(Vec.along(this.forward, this.right, right), this.up, up));
  }

  /** Return the point at a pixel on the plane through a point [m, NED]; null if there is none. */
  placeOnPlane(x, y, through, normal) {
    const ray = this.ray(x, y);
    const length = Vec.dot(Vec.sub(through, this.eye), normal) / Vec.dot(ray, normal);
    return length > 0 && Number.isFinite(length) ? Vec.along(this.eye, ray, length) : null;
  }

  /** Return the scale at a point [pixels/m]. */
  scaleAt(p) { return this.focal / Vec.dot(Vec.sub(p, this.eye), this.forward); }

  _changed() {
    this.fitted = false;
    this._update();
    for (const listener of this.listeners) listener();
  }

  _update() {
    const [cosA, sinA] = [Math.cos(this.azimuth), Math.sin(this.azimuth)];
    const [cosE, sinE] = [Math.cos(this.elevation), Math.sin(this.elevation)];
    this.forward = [-cosE * cosA, -cosE * sinA, sinE];
    this.right = [sinA, -cosA, 0];
    this.up = Vec.cross(this.right, this.forward);
    this.eye = Vec.along(this.target, this.forward, -this.distance);
    this.focal = (0.5 * Math.hypot(this.width, this.height)) / Math.tan(HALF_VIEW);
    this.near = Math.min(0.1, 0.02 * this.distance);
  }
}
