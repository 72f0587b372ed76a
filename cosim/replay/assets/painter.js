// Projected drawing: strokes and fills of surfaces, sheets and ellipsoids, for each kind of region.

/** Drawing of world geometry into a 2D context through a camera. */
class Painter {
  constructor(context, camera) {
    this.context = context;
    this.camera = camera;
    this.seen = new Float64Array(3072); // pixels and depth of each point of the current surface
    this.front = new Uint8Array(1024); // 1 for each of its faces towards the eye
    this.whole = true; // true if all of it is in front of the camera
  }

  /** Set the current surface: project its points and mark the faces towards the eye. */
  look(solid, shift) {
    const { faces, normals, points } = solid;
    const { camera } = this;
    if (this.seen.length < points.length) this.seen = new Float64Array(2 * points.length);
    if (this.front.length < faces.length) this.front = new Uint8Array(2 * faces.length);
    const { seen, front } = this;
    camera.projectAll(points, points.length / 3, shift, seen);
    this.whole = true;
    for (let i = 2; i < points.length; i += 3) this.whole &&= seen[i] > camera.near;
    const [ex, ey, ez] = Vec.sub(camera.eye, shift);
    for (let i = 0; i < faces.length; i++) {
      const [k, v] = [3 * i, 3 * faces[i][0]];
      const [x, y, z] = [ex - points[v], ey - points[v + 1], ez - points[v + 2]];
      front[i] = normals[k] * x + normals[k + 1] * y + normals[k + 2] * z > 0 ? 1 : 0;
    }
  }

  /** Add a face of the current surface to the path. */
  face(solid, shift, i) {
    const face = solid.faces[i];
    if (!this.whole) {
      this.polygon(face.map((k) => pointOf(solid, shift, k)));
      return;
    }
    const { seen, context } = this;
    context.moveTo(seen[3 * face[0]], seen[3 * face[0] + 1]);
    for (let j = 1; j < face.length; j++) context.lineTo(seen[3 * face[j]], seen[3 * face[j] + 1]);
    context.closePath();
  }

  /** Add an edge of the current surface to the path. */
  edge(solid, shift, a, b) {
    if (!this.whole) {
      this.segment(pointOf(solid, shift, a), pointOf(solid, shift, b));
      return;
    }
    const { seen, context } = this;
    context.moveTo(seen[3 * a], seen[3 * a + 1]);
    context.lineTo(seen[3 * b], seen[3 * b + 1]);
  }

  /** Begin a path for segment() and polygon(). */
  begin() {
    this.context.beginPath();
  }

  /** Add a line between two points of the world, clipped at the near plane. */
  segment(a, b) {
    const { near } = this.camera;
    let p = this.camera.project(a);
    let q = this.camera.project(b);
    if (p[2] < near && q[2] < near) return;
    if (p[2] < near) p = this.camera.project(Vec.along(a, Vec.sub(b, a), (near - p[2]) / (q[2] - p[2])));
    else if (q[2] < near) q = this.camera.project(Vec.along(b, Vec.sub(a, b), (near - q[2]) / (p[2] - q[2])));
    this.context.moveTo(p[0], p[1]);
    this.context.lineTo(q[0], q[1]);
  }

  /** Add a line through points of the world. */
  line(points) {
    for (let i = 1; i < points.length; i++) this.segment(points[i - 1], points[i]);
  }

  /** Add a closed polygon of the world, clipped at the near plane. */
  polygon(corners) {
    const { camera } = this;
    const ahead = (p) => Vec.dot(Vec.sub(p, camera.eye), camera.forward) - camera.near;
    const cut = corners.every((p) => ahead(p) >= 0) ? corners : cutPolygon(corners, ahead);
    cut.forEach((p, i) => {
      const [x, y] = camera.project(p);
      if (i) this.context.lineTo(x, y);
      else this.context.moveTo(x, y);
    });
    if (cut.length) this.context.closePath();
  }

  /** Add a line through points of the current surface, by their indices. */
  chain(line) {
    const { seen, context } = this;
    context.moveTo(seen[3 * line[0]], seen[3 * line[0] + 1]);
    for (let j = 1; j < line.length; j++) context.lineTo(seen[3 * line[j]], seen[3 * line[j] + 1]);
  }

  stroke(colour, width, alpha = 1, dash = null) {
    const { context } = this;
    context.globalAlpha = alpha;
    context.strokeStyle = colour;
    context.lineWidth = width;
    if (dash) context.setLineDash(dash);
    context.stroke();
    if (dash) context.setLineDash([]);
    context.globalAlpha = 1;
  }

  fill(colour, alpha = 1) {
    this.context.globalAlpha = alpha;
    this.context.fillStyle = colour;
    this.context.fill();
    this.context.globalAlpha = 1;
  }
}

/** Return the style of a region, from its kind (keep in or out) and from being active or not. */
function styleOf(keep, active, colour) {
  return {
    colour,
    filled: keep === "out",
    alpha: active ? 0.5 : 0.24,
    width: active ? 2.6 : 1.2,
    dash: keep === "in" ? (active ? [9, 5] : [6, 5]) : null,
    hidden: active ? 0.5 : 0.28, // opacity of edges on the far side
  };
}

/** Draw the far side of a surface; what lies in the surface is drawn over it. */
function paintBack(painter, solid, shift, style) {
  if (solid.ellipsoid) paintCircles(painter, solid, shift, style, false);
  else paintEdges(painter, solid, shift, style, false);
}

/** Draw the near side of a surface. */
function paintFront(painter, solid, shift, style) {
  if (solid.ellipsoid) {
    const outline = outlineOf(painter.camera, solid.ellipsoid, shift);
    if (outline) paintBall(painter, outline, style);
    paintCircles(painter, solid, shift, style, true);
    return;
  }
  if (style.filled) paintFaces(painter, solid, shift, style);
  paintEdges(painter, solid, shift, style, true);
}

/** Return the ellipse that an ellipsoid projects to: center and matrix from the unit circle; null if it is no ellipse. */
function outlineOf(camera, { centre, axes }, shift) {
  const c = Vec.sub(Vec.add(centre, shift), camera.eye);
  const rows = [camera.right, Vec.scale(camera.up, -1), camera.forward];
  const C = rows.map((row) => Vec.dot(row, c));
  const A = rows.map((row) => axes.map((axis) => Vec.dot(row, axis)));
  // lines n through the eye are tangent where n' G n = 0
  const G = (i, j) => Vec.dot(A[i], A[j]) - C[i] * C[j];
  const scale = -G(2, 2);
  if (C[2] <= 0 || scale <= 0 || C[2] - Vec.norm(A[2]) < camera.near) return null;
  const f = camera.focal;
  const [x, y] = [-G(0, 2) / scale, -G(1, 2) / scale];
  const [xx, xy, yy] = [G(0, 0) / scale + x * x, G(0, 1) / scale + x * y, G(1, 1) / scale + y * y];
  // square root of a symmetric matrix
  const s = Math.sqrt(Math.max(0, xx * yy - xy * xy));
  const t = Math.sqrt(xx + yy + 2 * s);
  if (!(t > 0)) return null;
  return {
    x: 0.5 * camera.width + f * x,
    y: 0.5 * camera.height + f * y,
    xx: (f * (xx + s)) / t,
    xy: (f * xy) / t,
    yy: (f * (yy + s)) / t,
  };
}

/** Draw the fill and the outline of an ellipse; the fill is brighter where light from above falls. */
function paintBall(painter, outline, style) {
  const { context, camera } = painter;
  context.beginPath();
  context.save();
  context.transform(outline.xx, outline.xy, outline.xy, outline.yy, outline.x, outline.y);
  context.arc(0, 0, 1, 0, 2 * Math.PI);
  if (style.filled) {
    const [lx, ly] = [0.25 * camera.right[2] - 0.22, -0.62 * Math.abs(camera.up[2])];
    const light = context.createRadialGradient(lx, ly, 0, 0, 0, 1);
    light.addColorStop(0, mixedColour(style.colour, "#ffffff", 0.55));
    light.addColorStop(0.55, style.colour);
    light.addColorStop(1, mixedColour(style.colour, "#000000", 0.22));
    context.globalAlpha = style.alpha + 0.15;
    context.fillStyle = light;
    context.fill();
    context.globalAlpha = 1;
  }
  context.restore();
  painter.stroke(style.colour, style.width, 1, style.dash);
}

/** Draw the great circles of an ellipsoid, on the near or on the far side. */
function paintCircles(painter, solid, shift, style, near) {
  const { context, camera } = painter;
  const { points } = solid;
  painter.look(solid, shift);
  const { seen } = painter;
  const [ex, ey, ez] = Vec.sub(Vec.sub(camera.eye, shift), solid.centre);
  const inverse = solid.ellipsoid.axes.map((axis) => Vec.scale(axis, 1 / Vec.dot(axis, axis)));
  // the near side is where (p - c)' M (e - c) > 1, with M of the ellipsoid
  const e = inverse.map((row) => row[0] * ex + row[1] * ey + row[2] * ez);
  const m = [0, 1, 2].map((i) => inverse.reduce((sum, row, k) => sum + row[i] * e[k], 0));
  const [cx, cy, cz] = solid.centre;
  context.beginPath();
  for (const line of solid.lines) {
    let drawing = false;
    for (const i of line) {
      const k = 3 * i;
      const before = m[0] * (points[k] - cx) + m[1] * (points[k + 1] - cy) + m[2] * (points[k + 2] - cz) > 1;
      if (before === near && seen[k + 2] > camera.near) {
        if (drawing) context.lineTo(seen[k], seen[k + 1]);
        else context.moveTo(seen[k], seen[k + 1]);
        drawing = true;
      } else drawing = false;
    }
  }
  painter.stroke(style.colour, 0.8, near ? 0.55 : style.hidden * 0.7);
}

/** Return a point of a shifted surface, by its index. */
function pointOf({ points }, shift, k) {
  return [points[3 * k] + shift[0], points[3 * k + 1] + shift[1], points[3 * k + 2] + shift[2]];
}

const LIGHT_SIDE = 0.35; // down component of normals beyond which faces are lit (upward) or shaded (downward)

/** Fill the visible faces, in one path so that no seam shows; lit from above in three steps. */
function paintFaces(painter, solid, shift, style) {
  painter.look(solid, shift);
  const { front } = painter;
  const { faces, normals } = solid;
  const paint = (least, most, colour, alpha) => {
    painter.begin();
    let any = false;
    for (let i = 0; i < faces.length; i++) {
      const down = normals[3 * i + 2];
      if (!front[i] || down < least || down > most) continue;
      painter.face(solid, shift, i);
      any = true;
    }
    if (any) painter.fill(colour, alpha);
  };
  paint(-2, 2, style.colour, style.alpha);
  paint(-2, -LIGHT_SIDE, mixedColour(style.colour, "#ffffff", 0.6), 0.22);
  paint(LIGHT_SIDE, 2, "#000000", 0.16);
}

/** Join edges to lines through shared points, so that dashes continue from one edge to the next. */
function linesOf(edges) {
  const at = new Map(); // for each point, the edges that are not yet in a line
  for (const edge of edges) for (const k of [edge[0], edge[1]]) at.set(k, (at.get(k) ?? new Set()).add(edge));
  const lines = [];
  for (const edge of edges) {
    if (!at.get(edge[0]).has(edge)) continue;
    const line = [edge[0]];
    for (let next = edge; next; next = at.get(line[line.length - 1]).values().next().value) {
      at.get(next[0]).delete(next);
      at.get(next[1]).delete(next);
      line.push(next[0] === line[line.length - 1] ? next[1] : next[0]);
    }
    lines.push(line);
  }
  return lines;
}

/** Draw the sharp edges of a surface on the near or far side; on the near side also its outline. */
function paintEdges(painter, solid, shift, style, near) {
  painter.look(solid, shift);
  const { front } = painter;
  const drawn = solid.edges.filter(([, , f, g, sharp]) => {
    const seen = front[f] || front[g];
    return sharp ? Boolean(seen) === near : near && front[f] !== front[g];
  });
  painter.begin();
  if (style.dash && painter.whole) for (const line of linesOf(drawn)) painter.chain(line);
  else for (const [a, b] of drawn) painter.edge(solid, shift, a, b);
  painter.stroke(style.colour, near ? style.width : 1, near ? 1 : style.hidden, style.dash);
}

/** Draw a part of a plane: nearly clear, with a rim and hatching on the forbidden side. */
function paintSheet(painter, sheet, style) {
  painter.begin();
  painter.polygon(sheet.corners);
  painter.fill(style.colour, style.filled ? 0.6 * style.alpha : 0.25 * style.alpha);
  painter.stroke(style.colour, style.width, 0.9, style.dash);
  painter.begin();
  for (const [a, b] of sheet.hatch) painter.segment(a, b);
  painter.stroke(style.colour, 1, 2 * style.hidden > 1 ? 1 : 2 * style.hidden);
}
