// The scene: vehicles, their ways and their regions at a time, as a camera sees them.

const LEAST_HULL = 12; // pixels of radius below which the vehicle is drawn larger than it is

/** A 3D scene of some runs on a canvas. */
class Scene {
  /** @param {HTMLCanvasElement} canvas  @param {Run[]} runs  @param {"light"|"dark"} theme */
  constructor(canvas, runs, theme) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d", { alpha: false });
    this.labels = new Labels(this.context);
    this.theme = theme;
    this._last = null; // time and options of the last frame
    this._redraw = () => this._later();
    this.camera = new Camera();
    controlCamera(canvas, () => this.camera);
    this.resize();
    this.setRuns(runs);
  }

  /** The camera; scenes that stand side by side may have one together. */
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

  /** Show other runs, all of them in the picture. */
  setRuns(runs) {
    this.runs = runs;
    this._trails = runs.map((run) => new Trail(run));
    this._forces = runs.map((run) => new Forces(run));
    this._sheets = new Map();
    this._drawn = { time: 0, runs: [] };
    this._followed = null;
    this._measure();
    this.camera.look("iso");
  }

  /** Take the size that the page gives to the canvas. */
  resize() {
    const { clientWidth, clientHeight } = this.canvas;
    this._ratio = Math.min(2, window.devicePixelRatio || 1);
    this.canvas.width = Math.max(1, Math.round(clientWidth * this._ratio));
    this.canvas.height = Math.max(1, Math.round(clientHeight * this._ratio));
    this._sky = null;
    this._fitsPicture();
    this._later();
  }

  /** What the last frame showed: time, and of each run pose, active region and the colour of each region. */
  get drawn() {
    return this._drawn;
  }

  /** Where a position [m, NED] is in the canvas [CSS pixels]. */
  project(position) {
    this._fitsPicture();
    return this.camera.project(position).slice(0, 2);
  }

  /** North and east of the point at a depth that is seen at some pixels; null where there is none. */
  placeOnPlane(x, y, depth) {
    this._fitsPicture();
    const { eye } = this.camera;
    const ray = this.camera.ray(x, y);
    const length = (depth - eye[2]) / ray[2];
    return length > 0 && Number.isFinite(length) ? [eye[0] + length * ray[0], eye[1] + length * ray[1]] : null;
  }

  /** The region at some pixels, its name included: {run, region}, or null. */
  pick(x, y) {
    const named = this.labels.placed.find((box) => box.of && x >= box.x && x <= box.x + box.width && y >= box.y && y <= box.y + box.height);
    if (named) return named.of;
    this._fitsPicture();
    const { eye } = this.camera;
    const far = Vec.along(eye, this.camera.ray(x, y), 1e5);
    for (const { feature, of } of this._sights ?? []) {
      const [u, v] = feature ? this.camera.project(feature) : [Infinity, Infinity];
      if (Math.hypot(u - x, v - y) < 14) return of;
    }
    for (const { solid, shift, of } of [...(this._entries ?? [])].reverse()) {
      if (solid && solid.hides(Vec.sub(eye, shift), Vec.sub(far, shift))) return of;
    }
    return null;
  }

  /**
   * Draw the scene at a time.
   * @param {number} t [s]  @param {{follow: boolean, trail: boolean, labels: boolean}} options
   */
  draw(t, options = {}) {
    this._last = [t, options];
    const { trail = true, labels = true } = options;
    this._fitsPicture();
    this._grow();
    const poses = this.runs.map((run) => poseOf(run, t));
    this._follow(options.follow ? poses.find(Boolean) : null);
    const { context, painter, camera } = this;
    const colours = SCENE_THEMES[this.theme];
    context.setTransform(this._ratio, 0, 0, this._ratio, 0, 0);
    context.lineJoin = "round";
    this._paintSky(colours);
    this.labels.begin(camera.width, camera.height);

    const regions = this._regionsAt(t, poses);
    this._entries = farthestFirst(regions.filter((entry) => entry.solid || entry.sheet), camera.eye);
    this._sights = regions.filter((entry) => entry.sight).map((entry) => ({ ...entry, feature: entry.sight.feature }));
    paintSurface(painter, this.bounds, colours);
    paintFloor(painter, this.labels, this.bounds, colours, labels);
    paintRuler(painter, this.labels, this.bounds, colours, labels);
    this._paintShadows(poses, colours);

    const vehicles = poses.map((pose, i) => pose && this._vehicle(pose, i));
    const things = vehicles.flatMap((vehicle) => (vehicle ? vehicle.faces : []));
    if (trail) this._trails.forEach((way, i) => things.push(...this._way(way, i, t, colours)));
    const lists = placedAmong(this._entries, things, camera.eye);
    for (const { sight, style } of this._sights) paintSight(painter, sight, style);
    this._entries.forEach((entry, k) => {
      if (entry.solid) paintBack(painter, entry.solid, entry.shift, entry.style);
      this._paintThings(lists[k], colours);
      if (entry.solid) paintFront(painter, entry.solid, entry.shift, entry.style);
      else paintSheet(painter, entry.sheet, entry.style);
    });
    this._paintThings(lists[this._entries.length], colours);
    vehicles.forEach((vehicle, i) => vehicle && this._paintOnVehicle(vehicle, i, t));

    paintCompass(painter, this.labels, colours);
    paintScale(painter, this.labels, colours, Math.max(1, ...vehicles.map((vehicle) => vehicle?.magnified ?? 1)));
    if (labels) this._nameRegions(regions, colours);
    if (labels && this.runs.length > 1) this._nameVehicles(vehicles, colours);
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
    const { content, bounds } = extentOf(this.runs);
    this.bounds = bounds;
    this._rows = this.runs.map((run) => run.rows);
    this._sheets.clear();
    this.camera.content = content;
    const lead = this.runs.find((run) => run.rows);
    if (!lead) return;
    const [a, b] = [lead.pose(lead.start).position, lead.pose(lead.end).position];
    const way = Vec.sub(b, a);
    if (Vec.finite(way)) this.camera.bearing = Math.atan2(way[1], way[0]);
  }

  /** A live run may leave the bounds. */
  _grow() {
    const left = this.runs.some((run, i) => {
      if (run.rows === this._rows[i]) return false;
      const { position } = run.pose(run.end);
      return Vec.finite(position) && position.some((x, k) => x < this.bounds[0][k] || x > this.bounds[1][k]);
    });
    if (left) this._measure();
  }

  _follow(pose) {
    if (pose) {
      const moved = this._followed ? Vec.sub(pose.position, this._followed) : Vec.sub(pose.position, this.camera.target);
      if (Vec.norm(moved) > 0) {
        this._quiet(() => this.camera.aim(Vec.add(this.camera.target, moved)));
      }
    }
    this._followed = pose ? pose.position : null;
  }

  /** Move the camera within a frame, without asking for another. */
  _quiet(move) {
    this.camera.listeners.delete(this._redraw);
    move();
    this.camera.listeners.add(this._redraw);
  }

  _paintSky(colours) {
    const { context, camera } = this;
    if (!this._sky) {
      this._sky = context.createLinearGradient(0, 0, 0, camera.height);
      this._sky.addColorStop(0, colours.skyTop);
      this._sky.addColorStop(1, colours.skyBottom);
    }
    context.fillStyle = this._sky;
    context.fillRect(0, 0, camera.width, camera.height);
  }

  /** What there is of each region at a time, one entry for each surface, sheet or sight. */
  _regionsAt(t, poses) {
    const entries = [];
    this.runs.forEach((run, r) => {
      const active = run.active(t);
      run.header.regions.forEach((region, i) => {
        const [shape, shift] = [run.shape(i, t), run.rows ? run.shift(i, t) : [0, 0, 0]];
        const same = entries.find((entry) => entry.of.run !== r && sameRegion(entry, region, shape, shift));
        if (same) {
          same.owners.push([r, i]);
          if (active === i && !same.active) this._dress(same, true);
          return;
        }
        const all = this._entriesOf(shape, shift, region, poses[r]);
        for (const entry of all) {
          Object.assign(entry, { of: { run: r, region: i }, region, shape, shift, owners: [[r, i]] });
          this._dress(entry, active === i);
          entries.push(entry);
        }
      });
    });
    return entries;
  }

  _dress(entry, active) {
    entry.active = active;
    entry.colour = regionColour(entry.region, active, this.theme);
    entry.style = styleOf(entry.region.keep, active, entry.colour);
  }

  _entriesOf(shape, shift, region, pose) {
    if (SOLIDS[shape.kind]) {
      const solid = surfaceOf(shape);
      if (!isThere(Vec.add(solid.centre, shift))) return [];
      const middle = Vec.add(solid.spine ? nearestOnChain(solid.spine, Vec.sub(this.camera.target, shift)) : solid.centre, shift);
      return [{ solid, middle }];
    }
    if (PLANES[shape.kind]) {
      const key = JSON.stringify([shape, region.keep, shift]);
      if (!this._sheets.has(key)) {
        if (this._sheets.size > 200) this._sheets.clear();
        this._sheets.set(key, sheetsOf(shape, region.keep, shift, this.bounds));
      }
      return this._sheets.get(key).map((sheet) => ({ sheet, middle: Vec.scale(Vec.add(...sheet.corners.slice(0, 2)), 0.5) }));
    }
    if (!pose) return [];
    return [{ sight: SIGHTS[shape.kind](shape, pose, shift, pose.size) }];
  }

  _vehicle(pose, index) {
    const { vehicle } = this.runs[index].header;
    const pixels = vehicle.radius * this.camera.scaleAt(pose.position);
    const magnified = pixels > 0 ? Math.max(1, LEAST_HULL / pixels) : 1;
    const size = vehicle.radius * magnified;
    const placed = { position: pose.position, R: Vec.matrix(pose.quaternion) };
    return { pose: placed, size, magnified, faces: hullAt(placed, size, this.camera.eye, this.theme) };
  }

  _way(way, index, t, colours) {
    const { run } = way;
    const several = this.runs.length > 1;
    const [xs, ys, zs] = ["x", "y", "z"].map((axis) => run.column(`position.${axis}`));
    return way.chunks(this.camera, t).map(({ points, row, past, active }) => {
      const region = run.header.regions[Number.isFinite(active) ? active : 0];
      const colour = several ? runColour(index) : fullColour(region);
      return { points, middle: [xs[row], ys[row], zs[row]], colour: past || several ? colour : colours.future, past };
    });
  }

  /** Thin things of one list: faces one by one, neighbouring lines of one colour in one stroke. */
  _paintThings(things, colours) {
    const { context, painter } = this;
    for (let k = 0; k < things.length; ) {
      const thing = things[k];
      if (thing.corners) {
        painter.begin();
        painter.polygon(thing.corners);
        painter.fill(thing.colour);
        painter.stroke(thing.colour, 0.7);
        k += 1;
        continue;
      }
      context.beginPath();
      for (; k < things.length && things[k].points && things[k].colour === thing.colour && things[k].past === thing.past; k++) {
        const { points } = things[k];
        context.moveTo(points[0], points[1]);
        for (let i = 2; i < points.length; i += 2) context.lineTo(points[i], points[i + 1]);
      }
      if (thing.past) painter.stroke(colours.halo, 6);
      painter.stroke(thing.colour, thing.past ? 3 : 1.4, thing.past ? 1 : 0.7);
    }
  }

  _paintOnVehicle({ pose, size }, index, t) {
    const { painter } = this;
    const { vehicle } = this.runs[index].header;
    paintThrusters(painter, pose, vehicle.thrusters, size, vehicle.radius, SCENE_THEMES[this.theme].hull.tube);
    paintBodyAxes(painter, pose, size, this.theme);
    paintForces(painter, pose, this._forces[index].at(t), size, vehicle.radius, this.theme);
  }

  _paintShadows(poses, colours) {
    const { painter, context, camera } = this;
    const floor = this.bounds[1][2];
    painter.begin();
    for (const { solid, shift, style } of this._entries) {
      if (!solid || !style.filled) continue;
      solid.shadow ??= outlineFromAbove(solid.points);
      painter.polygon(solid.shadow.map(([n, e]) => [n + shift[0], e + shift[1], floor]));
    }
    painter.fill(colours.shadow);
    for (const pose of poses) {
      if (!pose) continue;
      const [n, e] = pose.position;
      painter.begin();
      painter.segment(pose.position, [n, e, floor]);
      painter.stroke(colours.soft, 1, 0.9, [3, 3]);
      const rim = rimOf([n, e, floor], [0, 0, 1], 0.5 * Math.PI, Math.max(pose.size, 5 / camera.scaleAt([n, e, floor])));
      painter.begin();
      painter.polygon(rim);
      painter.fill(colours.shadow);
      painter.stroke(colours.soft, 1, 0.6);
    }
    context.globalAlpha = 1;
  }

  _nameRegions(entries, colours) {
    const { camera, labels } = this;
    const named = new Set();
    for (const entry of entries) {
      const { run, region } = entry.of;
      const key = `${run}:${region}`;
      if (named.has(key)) continue;
      const [x, y, depth] = camera.project(anchorOf(entry, camera));
      if (!(depth > camera.near) || x < 0 || y < 0 || x > camera.width || y > camera.height) continue;
      named.add(key);
      labels.add({
        key, text: entry.active ? `▶ ${entry.region.name}` : entry.region.name, x, y,
        colour: entry.active ? colours.ink : colours.soft, edge: entry.colour, bold: entry.active, chip: colours.chip,
        rank: entry.active ? 0 : region === 0 ? 1 : 10 + depth * 1e-3, gap: 6, sides: ["above", "right", "left", "below"], of: entry.of,
      });
    }
  }

  _nameVehicles(vehicles, colours) {
    vehicles.forEach((vehicle, i) => {
      if (!vehicle) return;
      const [x, y, depth] = this.camera.project(vehicle.pose.position);
      if (depth < this.camera.near) return;
      const { name } = this.runs[i].header;
      const alike = this.runs.filter((run) => run.header.name === name).length > 1;
      const gap = 1.5 * vehicle.size * this.camera.scaleAt(vehicle.pose.position);
      this.labels.add({
        key: `vehicle ${i}`, text: alike ? `${name} (${i + 1})` : name, x, y, colour: colours.ink, edge: runColour(i), bold: true,
        chip: colours.chip, rank: 0.5, gap, sides: ["below", "right", "left", "above"],
      });
    });
  }

  _note(t, poses, entries) {
    const runs = this.runs.map((run, r) => {
      const colours = run.header.regions.map((region, i) => {
        const entry = entries.find(({ owners }) => owners.some(([a, b]) => a === r && b === i));
        return entry ? entry.colour : null;
      });
      const { position = null, quaternion = null } = poses[r] ?? {};
      return { position, quaternion, active: run.active(t), colours };
    });
    this._drawn = { time: t, runs };
  }
}

/** The pose of a run's vehicle with its radius; null where it is no number, or where there are no rows. */
function poseOf(run, t) {
  if (!run.rows) return null;
  const pose = run.pose(t);
  return Vec.finite(pose.position) && Vec.finite(pose.quaternion) ? { ...pose, size: run.header.vehicle.radius } : null;
}

/** Whether an entry of another run shows this region already: of the same name, shape and place. */
function sameRegion(entry, region, shape, shift) {
  return (
    !entry.sight && entry.region.name === region.name && entry.region.keep === region.keep &&
    entry.shift.every((x, i) => Math.abs(x - shift[i]) < 1e-3) && JSON.stringify(entry.shape) === JSON.stringify(shape)
  );
}

/** Where the name of an entry stands. */
function anchorOf({ solid, sheet, sight, shift, middle }, camera) {
  if (sight) return sight.anchor;
  if (sheet) return sheet.corners.reduce((a, b) => (camera.project(b)[0] > camera.project(a)[0] ? b : a));
  let top = Infinity;
  for (let i = 2; i < solid.points.length; i += 3) top = Math.min(top, solid.points[i]);
  return solid.spine ? middle : [middle[0], middle[1], top + shift[2]];
}
