// Scene: vehicles, their paths and their regions at a time, projected by a camera.

const LEAST_HULL = 15; // pixels, least radius at which the vehicle is drawn; less in a small picture

/** 3D scene of some runs on a canvas. */
class Scene {
  /**
   * @param {HTMLCanvasElement} canvas  @param {Run[]} runs  @param {"light"|"dark"} theme
   * @param {{name: string, colour: string}[]|null} marks as for setRuns()
   */
  constructor(canvas, runs, theme, marks = null) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d", { alpha: false });
    this.labels = new Labels(this.context);
    this.theme = theme;
    this._last = null; // time and options of the last frame
    this._followed = null; // where the followed vehicle was in it [m, NED]
    this._redraw = () => this._later();
    this.camera = new Camera();
    controlCamera(canvas, () => this.camera);
    this.resize();
    this.setRuns(runs, marks);
    this.camera.look("iso");
  }

  /** Return the camera; scenes side by side share one. */
  get camera() {
    return this._camera;
  }

  set camera(camera) {
    this._camera?.listeners.delete(this._redraw);
    this._camera = camera;
    camera.listeners.add(this._redraw);
    this.painter = new Painter(this.context, camera);
  }

  /** @param {"light"|"dark"} theme */
  setTheme(theme) {
    this.theme = theme;
    this._sky = null;
    this._later();
  }

  /**
   * Show other runs; the camera stays.
   * @param {Run[]} runs
   * @param {{name: string, colour: string}[]|null} marks of the runs; null: default marks for several runs, none for one,
   * whose path then has the colors of the active regions
   */
  setRuns(runs, marks = null) {
    this.runs = runs;
    const own = runs.map(({ header }, i) => ({ name: header.name, colour: runColour(i) }));
    this._runMarks = marks ?? (runs.length > 1 ? own : null);
    this._trails = runs.map((run) => new Trail(run));
    this._forces = runs.map((run) => new Forces(run));
    this._regions = new Regions(runs);
    this._drawn = { time: 0, runs: [] };
    this._measure();
    this._later();
  }

  /** Fit the canvas to its size in the page. */
  resize() {
    const { clientWidth, clientHeight } = this.canvas;
    this._ratio = Math.min(2, window.devicePixelRatio || 1);
    this.canvas.width = Math.max(1, Math.round(clientWidth * this._ratio));
    this.canvas.height = Math.max(1, Math.round(clientHeight * this._ratio));
    this._sky = null;
    this._fitsPicture();
    this._later();
  }

  /** Return what the last frame showed: time, and for each run the pose, active region, current and color of each region. */
  get drawn() {
    return this._drawn;
  }

  /** Return the pixel [CSS pixels] of a position [m, NED] in the canvas. */
  project(position) {
    this._fitsPicture();
    return this.camera.project(position).slice(0, 2);
  }

  /** Return north and east of the point at a pixel and a depth [m]; null if there is none. */
  placeOnPlane(x, y, depth) {
    this._fitsPicture();
    const { eye } = this.camera;
    const ray = this.camera.ray(x, y);
    const length = (depth - eye[2]) / ray[2];
    return length > 0 && Number.isFinite(length) ? [eye[0] + length * ray[0], eye[1] + length * ray[1]] : null;
  }

  /** Return the region whose label, feature or surface is at a pixel: {run, region, place of a goal in turn}; null if there is none. */
  pick(x, y) {
    const named = this.labels.nameAt(x, y);
    if (named) return named;
    this._fitsPicture();
    const { eye } = this.camera;
    const far = Vec.along(eye, this.camera.ray(x, y), 1e5);
    for (const { feature, of } of this._sights ?? []) {
      const [u, v] = feature ? this.camera.project(feature) : [Infinity, Infinity];
      if (Math.hypot(u - x, v - y) < 14) return of;
    }
    for (const { solid, shift, of } of [...(this._entries ?? [])].reverse()) {
      if (solid?.from(Vec.sub(eye, shift))(...Vec.sub(far, shift))) return of;
    }
    return null;
  }

  /**
   * Draw the scene at a time.
   * @param {number} t [s]  @param {{follow: boolean, trail: boolean, labels: boolean, covered: number[][]}} options
   */
  draw(t, options = {}) {
    this._last = [t, options];
    if (this._waiting) cancelAnimationFrame(this._waiting); // this frame replaces the requested one
    this._waiting = 0;
    const { trail = true, labels = true } = options;
    this._fitsPicture();
    this._grow();
    const poses = this.runs.map((run) => poseOf(run, t));
    this._follow(options.follow ? poses.find(Boolean) : null);
    const { context, painter, camera } = this;
    const colours = SCENE_THEMES[this.theme];
    context.lineJoin = "bevel"; // round joins cost as much as the lines
    this._paintSky(colours);
    this.labels.begin(camera.width, camera.height);
    for (const box of options.covered ?? []) this.labels.block(...box);

    const regions = this._regions.at(t, poses, camera.target, this.theme);
    this._entries = farthestFirst(regions.filter((entry) => entry.solid || entry.sheet), camera.eye);
    this._sights = regions.filter((entry) => entry.sight).map((entry) => ({ ...entry, feature: entry.sight.feature }));
    paintSurface(painter, this.bounds, colours);
    paintFloor(painter, this.labels, this.bounds, colours, labels);
    paintRuler(painter, this.labels, this.bounds, colours, labels);
    const vehicles = poses.map((pose, i) => pose && this._vehicle(pose, i));
    const floor = this.bounds[1][2];
    paintShadows(painter, this._entries, this.bounds, colours);
    const things = vehicles.flatMap((vehicle) => (vehicle ? vehicle.things : []));
    if (trail) {
      this._trails.forEach((way, i) => {
        const chunks = this._way(way, i, t, colours);
        paintWayBelow(painter, chunks, floor, colours);
        things.push(...chunks, ...this._marks(way, i, t, vehicles[i], colours));
      });
    }
    for (const vehicle of vehicles) if (vehicle) paintPlumb(painter, vehicle, floor, colours);
    // a sight begins at the vehicle and is drawn just behind it
    for (const entry of this._sights) {
      things.push({ ...entry, middle: Vec.along(entry.sight.apex, camera.forward, entry.size) });
    }
    const lists = placedAmong(this._entries, things, camera.eye);
    this._entries.forEach((entry, k) => {
      if (entry.solid) paintBack(painter, entry.solid, entry.shift, entry.style);
      this._paintThings(lists[k], colours);
      if (entry.solid) paintFront(painter, entry.solid, entry.shift, entry.style);
      else paintSheet(painter, entry.sheet, entry.style);
    });
    this._paintThings(lists[this._entries.length], colours);
    vehicles.forEach((vehicle, i) => {
      if (!vehicle) return;
      const { radius } = this.runs[i].header.vehicle;
      paintForces(painter, vehicle.pose, this._forces[i].at(t), vehicle.size, radius, this.theme);
    });

    paintCompass(painter, this.labels, colours);
    paintCurrents(painter, this.labels, colours, this.runs, t);
    paintScale(painter, this.labels, colours, Math.max(1, ...vehicles.map((vehicle) => vehicle?.magnified ?? 1)));
    for (const vehicle of vehicles) if (vehicle) blockVehicle(this.labels, camera, vehicle);
    if (labels) nameRegions(this.labels, camera, regions, colours, this.runs, t);
    if (labels && this._runMarks) nameVehicles(this.labels, camera, this._runMarks, vehicles, colours);
    this.labels.draw();
    this._note(t, poses, regions);
  }

  _later() {
    if (!this._last || this._waiting) return;
    this._waiting = requestAnimationFrame(() => {
      this._waiting = 0;
      this.draw(...this._last);
    });
  }

  _fitsPicture() {
    this.camera.resize(this.canvas.width / this._ratio, this.canvas.height / this._ratio);
  }

  _measure() {
    const { way: places, content, bounds } = extentOf(this.runs);
    this.bounds = bounds;
    this._rows = this.runs.map((run) => run.rows);
    this._regions.bounds = bounds;
    Object.assign(this.camera, { content, way: places });
    const lead = this.runs.find((run) => run.rows);
    if (!lead) return;
    const way = Vec.sub(lead.pose(lead.end).position, lead.pose(lead.start).position);
    if (Vec.finite(way)) this.camera.bearing = Math.atan2(way[1], way[0]);
  }

  /** Measure the scene again if a live run has left the bounds. */
  _grow() {
    const left = this.runs.some((run, i) => {
      if (run.rows === this._rows[i]) return false;
      const { position } = run.pose(run.end);
      return Vec.finite(position) && position.some((x, k) => x < this.bounds[0][k] || x > this.bounds[1][k]);
    });
    if (!left) return;
    const { fitted } = this.camera;
    this._measure();
    if (fitted) this._quiet(() => this.camera.fit());
  }

  _follow(pose) {
    if (pose) {
      const moved = Vec.sub(pose.position, this._followed ?? this.camera.target);
      if (Vec.norm(moved) > 0) this._quiet(() => this.camera.aim(Vec.add(this.camera.target, moved)));
    }
    this._followed = pose ? pose.position : null;
  }

  /** Move the camera within a frame, without a request for another frame. */
  _quiet(move) {
    this.camera.listeners.delete(this._redraw);
    move();
    this.camera.listeners.add(this._redraw);
  }

  /** Paint the background; the gradient is cached, as copying is several times as fast. */
  _paintSky(colours) {
    const { context, canvas } = this;
    if (!this._sky) {
      this._sky = new OffscreenCanvas(canvas.width, canvas.height);
      const sky = this._sky.getContext("2d", { alpha: false });
      const gradient = sky.createLinearGradient(0, 0, 0, canvas.height);
      gradient.addColorStop(0, colours.skyTop);
      gradient.addColorStop(1, colours.skyBottom);
      sky.fillStyle = gradient;
      sky.fillRect(0, 0, canvas.width, canvas.height);
    }
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(this._sky, 0, 0);
    context.setTransform(this._ratio, 0, 0, this._ratio, 0, 0);
  }

  _vehicle(pose, index) {
    const { vehicle } = this.runs[index].header;
    const pixels = vehicle.radius * this.camera.scaleAt(pose.position);
    const least = Math.min(LEAST_HULL, 0.028 * Math.min(this.camera.width, this.camera.height));
    const magnified = pixels > 0 ? Math.max(1, least / pixels) : 1;
    const size = vehicle.radius * magnified;
    const placed = { position: pose.position, R: Vec.matrix(pose.quaternion) };
    const things = [...hullAt(vehicle, placed, size, this.camera.eye, this.theme), ...bodyAxes(placed, size)];
    return { pose: placed, size, magnified, things };
  }

  _way(way, index, t, colours) {
    const chunks = way.chunks(this.camera, t);
    for (const chunk of chunks) chunk.colour = this._wayColour(index, chunk.past, chunk.active, colours);
    return chunks;
  }

  /** Return the color of a piece of a path: the run's, if there are several; else the active region's for the past. */
  _wayColour(index, past, active, colours) {
    if (this._runMarks) return this._runMarks[index].colour;
    const { regions } = this.runs[index].header;
    return past ? regions[Number.isFinite(active) ? active : 0].colour : colours.future;
  }

  _marks(way, index, t, vehicle, colours) {
    const { camera } = this;
    const active = way.run.column("active");
    const spacing = roundStep((110 * camera.distance) / camera.focal);
    return way.marks(spacing).flatMap(({ row, time, from, middle }) => {
      const [[x, y, near], [u, v, depth]] = [camera.project(from), camera.project(middle)];
      const length = Math.hypot(u - x, v - y);
      if (Math.min(near, depth) < camera.near || !(length > 1)) return [];
      const onHull = vehicle && Vec.norm(Vec.sub(middle, vehicle.pose.position)) < 1.5 * vehicle.size;
      if (onHull) return [];
      const past = time <= t;
      const onTop = Vec.along(middle, Vec.sub(camera.eye, middle), 0.02); // above the line that it marks
      const colour = this._wayColour(index, past, active?.[row], colours);
      return [{ mark: [u, v, (u - x) / length, (v - y) / length], middle: onTop, past, colour }];
    });
  }

  /** Paint the thin things of one list: faces one by one, consecutive lines of one color in one stroke. */
  _paintThings(things, colours) {
    const { context, painter } = this;
    for (let k = 0; k < things.length; ) {
      const thing = things[k];
      if (!thing.points) {
        k += 1;
        if (thing.sight) paintSight(painter, thing.sight, thing.style);
        else if (thing.line) paintBodyAxis(painter, thing, colours.ink);
        else if (thing.mark) paintMark(painter, thing, colours);
        else {
          painter.begin();
          painter.polygon(thing.corners);
          painter.fill(thing.colour);
          painter.stroke(thing.colour, 0.7); // closes the seams between faces
        }
        continue;
      }
      context.beginPath();
      const goesOn = (next) => next?.points && next.colour === thing.colour && next.past === thing.past;
      for (; goesOn(things[k]); k++) {
        const { points } = things[k];
        context.moveTo(points[0], points[1]);
        for (let i = 2; i < points.length; i += 2) context.lineTo(points[i], points[i + 1]);
      }
      if (thing.past) painter.stroke(colours.halo, 6);
      painter.stroke(thing.colour, thing.past ? 3 : 1);
    }
  }

  _note(t, poses, entries) {
    const runs = this.runs.map((run, r) => {
      const colours = run.header.regions.map((region, i) => {
        const entry = entries.find(({ owners }) => owners.some(([a, b]) => a === r && b === i));
        return entry ? entry.colour : null;
      });
      const { position = null, quaternion = null } = poses[r] ?? {};
      return { position, quaternion, active: run.active(t), current: run.current(t), colours };
    });
    this._drawn = { time: t, runs };
  }
}

/** Return the pose of a run's vehicle with its radius [m]; null if it is not finite or there are no rows. */
function poseOf(run, t) {
  if (!run.rows) return null;
  const pose = run.pose(t);
  return Vec.finite(pose.position) && Vec.finite(pose.quaternion) ? { ...pose, size: run.header.vehicle.radius } : null;
}
