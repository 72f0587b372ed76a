// Scene: vehicles, their paths and their regions at a time, projected by a camera.

const LEAST_HULL = 15; // pixels, least radius at which the vehicle is drawn; less in a small picture

/** 3D scene of some runs on a canvas. */
class Scene {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d", { alpha: false });
    this.labels = new Labels(this.context);
    this.runs = [];
    this.ghost = null; // of a region that is dragged
    this._last = null; // time and options of the last frame
    this._followed = null; // where the followed vehicle was in it [m, NED]
    this._redraw = () => this._later();
    this.camera = new Camera();
    controlCamera(canvas, () => this.camera);
    this.resize();
  }

  /** Return the camera; scenes side by side share one. */
  get camera() { return this._camera; }

  set camera(camera) {
    this._camera?.listeners.delete(this._redraw);
    this._camera = camera;
    camera.listeners.add(this._redraw);
    this.painter = new Painter(this.context, camera);
  }

  /**
   * Show other runs; the camera stays.
   * @param {Run[]} runs
   * @param {{name: string, color: string}[]|null} marks of the runs; null for one run, whose path has the colors of
   * the active regions
   */
  setRuns(runs, marks) {
    this.runs = runs;
    this._runMarks = marks;
    this._trails = runs.map((run) => new Trail(run));
    this._forces = runs.map((run) => new Forces(run));
    this._drawn = { time: 0, runs: [] };
    this._measure();
    this._later();
  }

  /** Fit the canvas to its size in the page, in the colors of the theme. */
  resize() {
    const { canvas } = this;
    this._ratio = Math.min(2, window.devicePixelRatio);
    canvas.width = Math.max(1, Math.round(canvas.clientWidth * this._ratio));
    canvas.height = Math.max(1, Math.round(canvas.clientHeight * this._ratio));
    this._sky = null;
    this._fitsPicture();
    this._later();
  }

  /** Return what the last frame showed: time, and for each run pose, active region, current, colors of regions. */
  get drawn() { return this._drawn; }

  /** Return the pixel [CSS pixels] of a position [m, NED] in the canvas. */
  project(position) {
    this._fitsPicture();
    return this.camera.project(position).slice(0, 2);
  }

  /**
   * Return the region whose label, feature or surface is at a pixel: {run, region, place of a goal in turn}; null if
   * there is none.
   */
  pick(x, y) {
    this._fitsPicture();
    const { eye } = this.camera;
    const far = Vec.along(eye, this.camera.ray(x, y), 1e5);
    const isSeen = ({ sight, solid, shift }) => {
      if (solid) return solid.from(Vec.sub(eye, shift))(Vec.sub(far, shift));
      if (!sight?.feature) return false;
      const [u, v] = this.camera.project(sight.feature);
      return Math.hypot(u - x, v - y) < 14;
    };
    const entries = [...(this._sights ?? []), ...(this._entries ?? []).toReversed()];
    return this.labels.nameAt(x, y) ?? entries.find(isSeen)?.of ?? null;
  }

  /**
   * Draw the scene at a time.
   * @param {number} t [s]  @param {{follow: boolean, labels: boolean, covered: number[][]}} options
   */
  draw(t, options) {
    this._last = [t, options];
    cancelAnimationFrame(this._waiting); // this frame replaces the requested one
    this._waiting = 0;
    this._fitsPicture();
    this._grow();
    const { runs, context, painter, camera, labels } = this;
    const poses = runs.map((run) => poseOf(run, t));
    this._follow(options.follow ? poses.find(Boolean) : null);
    context.lineJoin = "bevel"; // round joins cost as much as the lines
    this._paintSky();
    labels.begin(camera.width, camera.height);
    for (const box of options.covered) labels.block(...box);

    const regions = regionsAt(runs, t, poses, camera.target, this.bounds);
    this._entries = farthestFirst(regions.filter(({ sight }) => !sight), camera.eye);
    this._sights = regions.filter(({ sight }) => sight);
    paintSurface(painter, this.bounds);
    paintFloor(painter, labels, this.bounds, options.labels);
    paintRuler(painter, labels, this.bounds, options.labels);
    paintShadows(painter, this._entries, this.bounds);
    const vehicles = poses.map((pose, i) => pose && this._vehicle(pose, i));
    const present = vehicles.filter(Boolean);
    const floor = this.bounds[1][2];
    const things = present.flatMap((vehicle) => vehicle.things);
    runs.forEach((run, i) => {
      const chunks = this._way(i, t);
      paintWayBelow(painter, chunks, floor);
      things.push(...chunks, ...this._marks(i, t, vehicles[i]));
    });
    for (const vehicle of present) paintPlumb(painter, vehicle, floor);
    // a sight begins at the vehicle and is drawn just behind it
    const behind = ({ sight, size }) => Vec.along(sight.apex, camera.forward, size);
    things.push(...this._sights.map((entry) => ({ ...entry, middle: behind(entry) })));
    const lists = placedAmong(this._entries, things, camera.eye);
    this._entries.forEach(({ solid, sheet, shift, style }, k) => {
      const view = solid && painter.look(solid, shift);
      if (solid) paintSurfaceSide(painter, view, style, false);
      this._paintThings(lists[k]);
      if (solid) paintSurfaceSide(painter, view, style, true);
      else paintSheet(painter, sheet, style);
    });
    this._paintThings(lists.at(-1));
    vehicles.forEach((vehicle, i) => {
      if (vehicle) paintForces(painter, vehicle, this._forces[i].at(t), runs[i].header.vehicle.radius);
    });

    paintCompass(painter, labels);
    paintCurrents(painter, labels, runs, t);
    paintScale(painter, labels, Math.max(1, ...present.map(({ magnified }) => magnified)));
    for (const { pose: { position }, size } of present) { // with its axes and forces, unless it fills the picture
      const half = Math.min(0.2 * camera.width, 0.2 * camera.height, 2 * size * camera.scaleAt(position));
      labels.blockAround(camera.project(position), half);
    }
    if (options.labels) nameRegions(labels, camera, regions, runs, t);
    if (options.labels && this._runMarks) nameVehicles(labels, camera, this._runMarks, vehicles);
    labels.draw();
    if (this.ghost) paintGhost(this, this.ghost);
    this._note(t, poses, regions);
  }

  _later() {
    if (this._last) this._waiting ||= requestAnimationFrame(() => this.draw(...this._last));
  }

  _fitsPicture() { this.camera.resize(this.canvas.width / this._ratio, this.canvas.height / this._ratio); }

  _measure() {
    const { way, content, bounds } = extentOf(this.runs);
    Object.assign(this, { bounds, content });
    this._rows = this.runs.map((run) => run.rows);
    Object.assign(this.camera, { content, way });
    const lead = this.runs.find((run) => run.rows);
    if (!lead) return;
    const [dx, dy] = Vec.sub(lead.pose(lead.end).position, lead.pose(lead.start).position);
    if (Number.isFinite(dx + dy)) this.camera.bearing = Math.atan2(dy, dx);
  }

  /** Measure the scene again if a live run has left the bounds. */
  _grow() {
    const left = this.runs.some((run, i) => {
      if (run.rows === this._rows[i]) return false;
      const { position } = run.pose(run.end);
      return Vec.finite(position) && !isInBox(position, this.bounds);
    });
    if (!left) return;
    const { fitted } = this.camera;
    this._measure();
    if (fitted) this._quiet(() => this.camera.fit());
  }

  _follow(pose) {
    if (pose) {
      const shift = Vec.sub(pose.position, this._followed ?? this.camera.target);
      if (Vec.norm(shift) > 0) this._quiet(() => this.camera.aim(Vec.add(this.camera.target, shift)));
    }
    this._followed = pose?.position;
  }

  /** Move the camera within a frame, without a request for another frame. */
  _quiet(move) {
    this.camera.listeners.delete(this._redraw);
    move();
    this.camera.listeners.add(this._redraw);
  }

  /** Paint the background; the gradient is cached, as copying is several times as fast. */
  _paintSky() {
    const { context, canvas: { width, height } } = this;
    if (!this._sky) {
      this._sky = new OffscreenCanvas(width, height);
      const sky = this._sky.getContext("2d", { alpha: false });
      sky.fillStyle = sky.createLinearGradient(0, 0, 0, height);
      sky.fillStyle.addColorStop(0, COLORS.skyTop);
      sky.fillStyle.addColorStop(1, COLORS.skyBottom);
      sky.fillRect(0, 0, width, height);
    }
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(this._sky, 0, 0);
    context.setTransform(this._ratio, 0, 0, this._ratio, 0, 0);
  }

  _vehicle({ position, quaternion }, index) {
    const { vehicle } = this.runs[index].header;
    const { width, height, eye } = this.camera;
    const pixels = vehicle.radius * this.camera.scaleAt(position);
    const magnified = pixels > 0 ? Math.max(1, Math.min(LEAST_HULL, 0.028 * width, 0.028 * height) / pixels) : 1;
    const size = vehicle.radius * magnified;
    const pose = { position, R: Vec.matrix(quaternion) };
    return { pose, size, magnified, things: [...hullAt(vehicle, pose, size, eye), ...bodyAxes(pose, size)] };
  }

  _way(index, t) {
    const chunks = this._trails[index].chunks(this.camera, t);
    for (const chunk of chunks) chunk.color = this._wayColor(index, chunk.past, chunk.active);
    return chunks;
  }

  /** Return the color of a piece of a path: the run's, if there are several; else the active region's for the past. */
  _wayColor(index, past, active) {
    if (this._runMarks) return this._runMarks[index].color;
    return past ? this.runs[index].header.regions[active || 0].color : COLORS.future;
  }

  _marks(index, t, vehicle) {
    const { camera } = this;
    const active = this.runs[index].column("active");
    const spacing = roundStep((110 * camera.distance) / camera.focal);
    return this._trails[index].marks(spacing).flatMap(({ row, time, from, middle }) => {
      const [[x, y, near], [u, v, depth]] = [camera.project(from), camera.project(middle)];
      const length = Math.hypot(u - x, v - y);
      const onHull = vehicle && Vec.distance(middle, vehicle.pose.position) < 1.5 * vehicle.size;
      if (Math.min(near, depth) < camera.near || !(length > 1) || onHull) return [];
      const past = time <= t;
      const onTop = Vec.along(middle, Vec.sub(camera.eye, middle), 0.02); // above the line that it marks
      const color = this._wayColor(index, past, active?.[row]);
      return [{ mark: [u, v, (u - x) / length, (v - y) / length], middle: onTop, past, color }];
    });
  }

  /** Paint the thin things of one list: faces one by one, consecutive lines of one color in one stroke. */
  _paintThings(things) {
    const { painter } = this;
    let lines = [];
    things.forEach((thing, k) => {
      const { points, sight, line, mark, corners, color, past, style } = thing;
      if (sight) paintSight(painter, sight, style);
      else if (line) paintBodyAxis(painter, thing);
      else if (mark) paintMark(painter, thing);
      else if (corners) {
        painter.begin();
        painter.polygon(corners);
        painter.fill(color);
        painter.stroke(color, 0.7); // closes the seams between faces
      } else {
        lines.push(points);
        const next = things[k + 1];
        if (next?.points && next.color === color && next.past === past) return;
        if (past) painter.strokeLines(lines, COLORS.halo, 6);
        painter.strokeLines(lines, color, past ? 3 : 1);
        lines = [];
      }
    });
  }

  _note(t, poses, entries) {
    const runs = this.runs.map((run, r) => {
      const colors = run.header.regions.map((_, i) =>
        entries.find(({ owners }) => owners.some(([a, b]) => a === r && b === i))?.color ?? null);
      const { position = null, quaternion = null } = poses[r] ?? {};
      return { position, quaternion, active: run.active(t), current: run.current(t), colors };
    });
    this._drawn = { time: t, runs };
  }
}

/** Return the pose of a run's vehicle with its radius [m]; null if it is not finite or there are no rows. */
function poseOf(run, t) {
  const pose = run.rows && run.pose(t);
  const finite = pose && Vec.finite([...pose.position, ...pose.quaternion]);
  return finite ? { ...pose, size: run.header.vehicle.radius } : null;
}
