// Regions of some runs at a time: their surfaces, sheets and sights, with colors and styles.

const NAMED_IN_SCENE = 6; // number of keep-out regions with labels, the nearest of each scene

/** Regions of some runs as entries to draw; equal regions of several runs are one entry. */
class Regions {
  /** @param {Run[]} runs */
  constructor(runs) {
    this.runs = runs;
    this._sheets = new Map();
  }

  /** Set the box to which sheets are clipped. */
  set bounds(bounds) {
    this._bounds = bounds;
    this._sheets.clear();
  }

  /**
   * Return one entry for each surface, sheet or sight.
   * @param {number} t time [s]  @param {object[]} poses of the vehicles, null where there is none
   * @param {number[]} target of the camera [m, NED]  @param {"light"|"dark"} theme
   */
  at(t, poses, target, theme) {
    const entries = [];
    this.runs.forEach((run, r) => {
      const active = run.active(t);
      run.header.regions.forEach((region, i) => {
        const shape = run.shape(i, t);
        for (const { place, next, shift } of placesOfRegion(run, i, t)) {
          const same = entries.filter((entry) => entry.of.run !== r && entry.next === next && sameRegion(entry, region, shape, shift));
          const isActive = active === i && !next;
          for (const entry of same) {
            if (!next) entry.owners.push([r, i]);
            if (isActive && !entry.active) dressEntry(entry, true, theme);
          }
          if (same.length) continue;
          for (const entry of this._of(shape, shift, region, poses[r], target)) {
            Object.assign(entry, { of: { run: r, region: i, place }, region, shape, shift, next, owners: next ? [] : [[r, i]] });
            dressEntry(entry, isActive, theme);
            entries.push(entry);
          }
        }
      });
    });
    return entries;
  }

  _of(shape, shift, region, pose, target) {
    const solid = surfaceOf(shape);
    if (solid) {
      if (!isThere(Vec.add(solid.centre, shift))) return [];
      const middle = solid.long ? nearestOnSurface(solid, Vec.sub(target, shift)) : solid.centre;
      return [{ solid, middle: Vec.add(middle, shift) }];
    }
    if (shape.drawing?.planes) {
      const key = JSON.stringify([shape, region.keep, shift]);
      if (!this._sheets.has(key)) {
        if (this._sheets.size > 200) this._sheets.clear(); // moving regions fill the cache
        this._sheets.set(key, sheetsOf(shape, region.keep, shift, this._bounds));
      }
      return this._sheets.get(key).map((sheet) => ({ sheet, middle: middleOf(sheet.corners) }));
    }
    return pose ? [{ sight: SIGHTS[shape.kind](shape, pose, shift, pose.size), size: pose.size }] : [];
  }
}

/** Return where a region is drawn at a time [s]: where it is, and the goal's next place: [{place, next, shift}]. */
function placesOfRegion(run, index, t) {
  const { places } = run.header.regions[index];
  if (!places) return [{ place: null, next: false, shift: run.rows ? run.shift(index, t) : [0, 0, 0] }];
  const now = run.goalPlace(t);
  return [now, now + 1].filter((place) => place < places.length).map((place) => ({ place, next: place > now, shift: places[place] }));
}

/** Return the mean of some points. */
function middleOf(points) {
  return points.reduce((sum, p) => Vec.along(sum, p, 1 / points.length), [0, 0, 0]);
}

/** Set color and style of an entry; an active region is drawn in full, the goal is seen through others, the next one dotted. */
function dressEntry(entry, active, theme) {
  entry.active = active;
  entry.colour = regionColour(entry.region, active, theme);
  entry.style = styleOf(entry.region.keep, active, entry.colour);
  if (!entry.region.criterion) Object.assign(entry.style, { filled: true, alpha: 0.1, width: 2.6, hidden: 0.6 });
  if (entry.next) Object.assign(entry.style, { filled: false, width: 1.6, dash: [2, 5], hidden: 0.35 });
}

/** Return true if an entry already shows a region of the same name, shape and place. */
function sameRegion(entry, region, shape, shift) {
  return (
    !entry.sight && entry.region.name === region.name && entry.region.keep === region.keep &&
    entry.shift.every((x, i) => Math.abs(x - shift[i]) < 1e-3) && JSON.stringify(entry.shape) === JSON.stringify(shape)
  );
}

/** Return the point at which the label of an entry is placed [m, NED]. */
function anchorOf({ solid, sheet, sight, shift, middle }, camera) {
  if (sight) return sight.anchor;
  if (sheet) return rightmostSeen(sheet.corners, camera);
  return solid.long ? middle : [middle[0], middle[1], solid.top + shift[2]];
}

/** Return the rightmost visible point on the edges of a polygon; if none is visible, the rightmost. */
function rightmostSeen(corners, camera) {
  const between = (a, b) => [0, 0.2, 0.4, 0.6, 0.8].map((part) => Vec.along(a, Vec.sub(b, a), part));
  const points = corners.flatMap((a, i) => between(a, corners[(i + 1) % corners.length]));
  const seen = points.map((p) => [p, ...camera.project(p)]);
  const inside = seen.filter(([, x, y, depth]) => depth > camera.near && x > 0 && y > 0 && x < camera.width && y < camera.height);
  return (inside.length ? inside : seen).reduce((a, b) => (b[1] > a[1] ? b : a))[0];
}

/** Return the entries of keep-out regions, sorted by clearance, the nearest first. */
function nearestFirst(entries, runs, t) {
  const gap = ({ of, region }) => {
    const clearance = runs[of.run].held(`${region.name}.clearance`, t);
    return Number.isNaN(clearance) ? Infinity : clearance;
  };
  return entries
    .filter(({ region }) => region.criterion && region.keep === "out")
    .map((entry) => [gap(entry), entry])
    .sort(([a], [b]) => (a < b ? -1 : a > b ? 1 : 0))
    .map(([, entry]) => entry);
}

/**
 * Add the labels of regions; the active one is marked, and only the nearest keep-out regions are labeled.
 * A region that has another place in each run is labeled with the run too.
 */
function nameRegions(labels, camera, entries, colours, runs, t) {
  for (const entry of entries) if (!entry.region.criterion && entry.solid) blockGoal(labels, camera, entry);
  const named = new Set();
  const names = runNames(runs);
  const isTwice = ({ of, region }) => entries.some((other) => other.of.run !== of.run && other.region.name === region.name);
  const nameOf = (entry) => {
    const name = regionName(entry.region, entry.of.place, entry.next ? "next" : "present");
    return entry.solid && isTwice(entry) ? `${name}, ${names[entry.of.run]}` : name;
  };
  const near = new Map(nearestFirst(entries, runs, t).map((entry, place) => [entry, place]));
  for (const entry of entries) {
    const key = `${entry.of.run}:${entry.of.region}:${entry.next}`;
    if (named.has(key)) continue;
    const [x, y, depth] = camera.project(anchorOf(entry, camera));
    if (!(depth > camera.near) || x < 0 || y < 0 || x > camera.width || y > camera.height) continue;
    named.add(key);
    const { active } = entry;
    const place = near.get(entry) ?? 0;
    if (place >= NAMED_IN_SCENE && !active) continue;
    labels.add({
      key, x, y, gap: 6, of: entry.of, size: camera.width < 480 && !active ? 10 : 12,
      text: active ? `▶ ${nameOf(entry)}` : nameOf(entry),
      colour: active ? colours.ink : colours.soft, edge: entry.colour, bold: active, chip: colours.chip,
      rank: active ? 0 : entry.of.region === 0 ? 1 + Number(entry.next) : 10 + place, far: active || entry.of.region === 0,
      sides: ["above", "right", "left", "below"],
    });
  }
}

/** Keep labels off the goal, unless it fills the picture. */
function blockGoal(labels, camera, { solid, middle }) {
  const [x, y, depth] = camera.project(middle);
  if (depth < camera.near) return;
  const half = (solid.centre[2] - solid.top) * camera.scaleAt(middle);
  if (half < 0.2 * Math.min(camera.width, camera.height)) labels.block(x - half, y - half, 2 * half, 2 * half);
}

/** Keep labels off a vehicle with its axes and forces, unless it fills the picture. */
function blockVehicle(labels, camera, { pose, size }) {
  const [x, y, depth] = camera.project(pose.position);
  if (depth < camera.near) return;
  const half = Math.min(0.2 * camera.width, 0.2 * camera.height, 2 * size * camera.scaleAt(pose.position));
  labels.block(x - half, y - half, 2 * half, 2 * half);
}

/** Add the labels of vehicles. */
function nameVehicles(labels, camera, marks, vehicles, colours) {
  vehicles.forEach((vehicle, i) => {
    if (!vehicle) return;
    const [x, y, depth] = camera.project(vehicle.pose.position);
    if (depth < camera.near) return;
    const { name, colour } = marks[i];
    labels.add({
      key: `vehicle ${i}`, x, y, gap: 1.5 * vehicle.size * camera.scaleAt(vehicle.pose.position),
      text: name, colour: colours.ink, edge: colour, bold: true, chip: colours.chip, rank: 0.5, far: true,
      sides: ["below", "right", "left", "above"],
    });
  });
}
