// Regions of some runs at a time: their surfaces, sheets and sights, with colors and styles; and their labels.

const NAMED_IN_SCENE = 6; // number of keep-out regions with labels, the nearest of each scene

/**
 * Return the regions of some runs as entries to draw, one for each surface, sheet or sight; equal regions of several
 * runs are one entry.
 * @param {Run[]} runs  @param {number} t time [s]  @param {object[]} poses of the vehicles, null where there is none
 * @param {number[]} target of the camera [m, NED]  @param {number[][]} bounds to which sheets are clipped
 */
function regionsAt(runs, t, poses, target, bounds) {
  const entries = [];
  runs.forEach((run, r) => {
    run.header.regions.forEach((region, i) => {
      const shape = run.shape(i, t);
      for (const { place, next, shift } of placesOfRegion(run, i, t)) {
        const active = run.active(t) === i && !next;
        let some = entries.filter((entry) =>
          entry.of.run !== r && entry.next === next && sameRegion(entry, region, shape, shift));
        if (!some.length) {
          const of = { run: r, region: i, place };
          some = partsOf(shape, shift, region, poses[r], target, bounds);
          for (const entry of some) Object.assign(entry, { of, region, shape, shift, next, active: false, owners: [] });
          entries.push(...some);
        }
        for (const entry of some) {
          if (!next) entry.owners.push([r, i]);
          entry.active ||= active;
        }
      }
    });
  });
  entries.forEach(dressEntry);
  return entries;
}

/** Return what is drawn of a region, with the position for the drawing order. */
function partsOf(shape, shift, { keep }, pose, target, bounds) {
  const solid = surfaceOf(shape);
  if (solid && !isThere(Vec.add(solid.center, shift))) return [];
  if (solid) {
    const middle = solid.long ? nearestOnSurface(solid, Vec.sub(target, shift)) : solid.center;
    return [{ solid, middle: Vec.add(middle, shift) }];
  }
  if (shape.drawing?.planes) {
    return sheetsOf(shape, keep, shift, bounds).map((sheet) => ({ sheet, middle: Vec.mean(sheet.corners) }));
  }
  return pose ? [{ sight: sightOf(shape, pose, shift, pose.size), size: pose.size }] : [];
}

/** Return where a region is drawn at a time [s]: where it is, and the goal's next place: [{place, next, shift}]. */
function placesOfRegion(run, index, t) {
  const { places } = run.header.regions[index];
  if (!places) return [{ place: null, next: false, shift: run.rows ? run.shift(index, t) : [0, 0, 0] }];
  const now = run.goalPlace(t);
  const at = (place) => run.shift(index, t, place); // the present one may be on its way
  return [...places.keys()].slice(now, now + 2).map((place) => ({ place, next: place > now, shift: at(place) }));
}

/** Set color and style of an entry: an active region in full, the goal seen through others, the next one dotted. */
function dressEntry(entry) {
  const { region, active, next } = entry;
  entry.color = regionColor(region, active);
  entry.style = styleOf(region.keep, active, entry.color);
  if (!region.criterion) Object.assign(entry.style, { filled: true, alpha: 0.1, width: 2.6, hidden: 0.6 });
  if (next) Object.assign(entry.style, { filled: false, width: 1.6, dash: [2, 5], hidden: 0.35 });
}

/** Return true if an entry already shows a region of the same name, shape and place. */
function sameRegion(entry, { name, keep }, shape, shift) {
  return !entry.sight && entry.region.name === name && entry.region.keep === keep &&
    entry.shift.every((x, i) => Math.abs(x - shift[i]) < 1e-3) && JSON.stringify(entry.shape) === JSON.stringify(shape);
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
  const projected = points.map((point) => ({ point, pixel: camera.project(point) }));
  const inside = projected.filter(({ pixel }) => camera.isInPicture(pixel));
  return (inside.length ? inside : projected).reduce((a, b) => (b.pixel[0] > a.pixel[0] ? b : a)).point;
}

/** Return the entries of keep-out regions, sorted by clearance, the nearest first. */
function nearestFirst(entries, runs, t) {
  const finite = ({ of, region }) => {
    const clearance = runs[of.run].held(`${region.name}.clearance`, t);
    return Number.isNaN(clearance) ? Number.MAX_VALUE : clearance;
  };
  const out = entries.filter(({ region }) => region.criterion && region.keep === "out");
  return out.sort((a, b) => finite(a) - finite(b));
}

/**
 * Add the labels of regions; the active one is marked, and only the nearest keep-out regions are labeled.
 * A region that has another place in each run is labeled with the run too.
 */
function nameRegions(labels, camera, entries, runs, t) {
  for (const { region, solid, middle } of entries) {
    const half = solid && (solid.center[2] - solid.top) * camera.scaleAt(middle);
    const fits = half < 0.2 * Math.min(camera.width, camera.height); // else it fills the picture
    if (!region.criterion && fits) labels.blockAround(camera.project(middle), half);
  }
  const named = new Set();
  const names = runNames(runs);
  const near = nearestFirst(entries, runs, t);
  for (const entry of entries) {
    const { of, region, next, active } = entry;
    const key = `${of.run}:${of.region}:${next}`;
    const pixel = camera.project(anchorOf(entry, camera));
    if (named.has(key) || !camera.isInPicture(pixel)) continue;
    named.add(key);
    const rank = Math.max(0, near.indexOf(entry));
    if (rank >= NAMED_IN_SCENE && !active) continue;
    const isTwice = entries.some((other) => other.of.run !== of.run && other.region.name === region.name);
    const name = regionName(region, of.place, next ? "next" : "present");
    const isGoal = of.region === 0;
    labels.add({
      key, x: pixel[0], y: pixel[1], gap: 6, of, size: camera.width < 480 && !active ? 10 : 12,
      text: (active ? "▶ " : "") + name + (entry.solid && isTwice ? `, ${names[of.run]}` : ""),
      color: active ? COLORS.ink : COLORS.soft, edge: entry.color, bold: active, chip: COLORS.chip,
      rank: active ? 0 : isGoal ? 1 + Number(next) : 10 + rank, far: active || isGoal,
      sides: ["above", "right", "left", "below"],
    });
  }
}

/** Add the labels of vehicles. */
function nameVehicles(labels, camera, marks, vehicles) {
  vehicles.forEach((vehicle, i) => {
    const [x, y, depth] = vehicle ? camera.project(vehicle.pose.position) : [];
    if (!(depth >= camera.near)) return;
    const { name, color } = marks[i];
    labels.add({
      key: `vehicle ${i}`, x, y, gap: 1.5 * vehicle.size * camera.scaleAt(vehicle.pose.position),
      text: name, color: COLORS.ink, edge: color, bold: true, chip: COLORS.chip, rank: 0.5, far: true,
      sides: ["below", "right", "left", "above"],
    });
  });
}
