// Projected drawing: strokes and fills of surfaces, sheets and ellipsoids, for each kind of region.

/** Drawing of world geometry into a 2D context through a camera. */
class Painter {
  constructor(context, camera) {
    this.context = context;
    this.camera = camera;
  }

  /** Return the view of a surface: pixels and depth of its points, and which of its faces are towards the eye. */
  look(solid, shift) {
    const { points, faces, normals } = solid;
    const eye = Vec.sub(this.camera.eye, shift);
    const seen = points.map((p) => this.camera.project(Vec.add(p, shift)));
    const front = faces.map((face, i) => Vec.dot(normals[i], Vec.sub(eye, points[face[0]])) > 0);
    return { solid, shift, eye, seen, front, whole: seen.every(([, , depth]) => depth > this.camera.near) };
  }

  /** Add a line through points of a surface, by their indices, to the path; or a face, which is closed. */
  trace({ solid, shift, seen, whole }, indices, closed = false) {
    if (!whole) {
      const points = indices.map((k) => Vec.add(solid.points[k], shift));
      if (closed) this.polygon(points);
      else this.line(points);
      return;
    }
    this._add(indices.map((k) => seen[k]));
    if (closed) this.context.closePath();
  }

  /** Begin a path. */
  begin() { this.context.beginPath(); }

  /** Add a line between two points of the world, clipped at the near plane. */
  segment(a, b) {
    const { camera } = this;
    const [p, q] = [camera.project(a), camera.project(b)];
    if (p[2] < camera.near && q[2] < camera.near) return;
    const cut = () => camera.project(Vec.along(a, Vec.sub(b, a), (camera.near - p[2]) / (q[2] - p[2])));
    this._add([p[2] < camera.near ? cut() : p, q[2] < camera.near ? cut() : q]);
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
    if (!cut.length) return;
    this._add(cut.map((p) => camera.project(p)));
    this.context.closePath();
  }

  stroke(color, width, alpha = 1, dash = []) {
    const { context } = this;
    Object.assign(context, { globalAlpha: alpha, strokeStyle: color, lineWidth: width });
    context.setLineDash(dash);
    context.stroke();
    context.setLineDash([]);
    context.globalAlpha = 1;
  }

  fill(color, alpha = 1) {
    Object.assign(this.context, { globalAlpha: alpha, fillStyle: color });
    this.context.fill();
    this.context.globalAlpha = 1;
  }

  /** Draw lines of pixels. */
  strokeLines(lines, color, width) {
    beginLines(this.context, ...lines);
    this.stroke(color, width);
  }

  _add(pixels) {
    this.context.moveTo(pixels[0][0], pixels[0][1]);
    for (let i = 1; i < pixels.length; i++) this.context.lineTo(pixels[i][0], pixels[i][1]);
  }
}

/** Return the style of a region, from its kind (keep in or out) and from being active or not. */
function styleOf(keep, active, color) {
  const [alpha, width, dash, hidden] = active ? [0.5, 2.6, [9, 5], 0.5] : [0.24, 1.2, [6, 5], 0.28];
  // hidden: opacity of edges on the far side
  return { color, filled: keep === "out", alpha, width, dash: keep === "in" ? dash : [], hidden };
}

/** Draw the far side of a surface, over which lies what is in it; or with `near` the near side. */
function paintSurfaceSide(painter, view, style, near) {
  if (view.solid.ellipsoid) {
    const outline = near && outlineOf(painter.camera, view.solid.ellipsoid, view.shift);
    if (outline) paintBall(painter, outline, style);
    paintCircles(painter, view, style, near);
    return;
  }
  if (near && style.filled) paintFaces(painter, view, style);
  paintEdges(painter, view, style, near);
}

/** Return the ellipse that an ellipsoid projects to: center and matrix from the unit circle; null if it is none. */
function outlineOf(camera, { center, axes }, shift) {
  const c = Vec.sub(Vec.add(center, shift), camera.eye);
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
  const k = f / Math.sqrt(xx + yy + 2 * s);
  if (!Number.isFinite(k)) return null;
  const [u, v] = [0.5 * camera.width + f * x, 0.5 * camera.height + f * y];
  return { x: u, y: v, xx: k * (xx + s), xy: k * xy, yy: k * (yy + s) };
}

/** Draw the fill and the outline of an ellipse; the fill is brighter where light from above falls. */
function paintBall(painter, outline, { filled, color, alpha, width, dash }) {
  const { context, camera } = painter;
  context.beginPath();
  context.save();
  context.transform(outline.xx, outline.xy, outline.xy, outline.yy, outline.x, outline.y);
  context.arc(0, 0, 1, 0, 2 * Math.PI);
  if (filled) {
    const [lx, ly] = [0.25 * camera.right[2] - 0.22, -0.62 * Math.abs(camera.up[2])];
    const light = context.createRadialGradient(lx, ly, 0, 0, 0, 1);
    light.addColorStop(0, mixedColor(color, "#ffffff", 0.55));
    light.addColorStop(0.55, color);
    light.addColorStop(1, mixedColor(color, "#000000", 0.22));
    painter.fill(light, alpha + 0.15);
  }
  context.restore();
  painter.stroke(color, width, 1, dash);
}

/** Draw the great circles of an ellipsoid, on the near or on the far side. */
function paintCircles(painter, { solid, eye, seen }, { color, hidden }, near) {
  const { context, camera } = painter;
  const { inverse, center, points } = solid;
  // the near side is where (p - c)' M (e - c) > 1, with M of the ellipsoid
  const e = Vec.turned(inverse, Vec.sub(eye, center));
  const isNear = (p) => Vec.dot(Vec.turned(inverse, Vec.sub(p, center)), e) > 1;
  context.beginPath();
  for (const line of solid.lines) {
    let drawing = false;
    for (const k of line) {
      const [x, y, depth] = seen[k];
      const shown = isNear(points[k]) === near && depth > camera.near;
      if (shown && drawing) context.lineTo(x, y);
      else if (shown) context.moveTo(x, y);
      drawing = shown;
    }
  }
  painter.stroke(color, 0.8, near ? 0.55 : hidden * 0.7);
}

const LIGHT_SIDE = 0.35; // down component of normals beyond which faces are lit (upward) or shaded (downward)

/** Fill the visible faces, in one path so that no seam shows; lit from above in three steps. */
function paintFaces(painter, view, { color, alpha }) {
  const paint = (least, most, ...fill) => {
    painter.begin();
    view.solid.faces.forEach((face, i) => {
      const down = view.solid.normals[i][2];
      if (view.front[i] && down >= least && down <= most) painter.trace(view, face, true);
    });
    painter.fill(...fill);
  };
  paint(-2, 2, color, alpha);
  paint(-2, -LIGHT_SIDE, mixedColor(color, "#ffffff", 0.6), 0.22);
  paint(LIGHT_SIDE, 2, "#000000", 0.16);
}

/** Join edges to lines through shared points, so that dashes continue from one edge to the next. */
function linesOf(edges) {
  const open = new Map(); // for each point, the edges that are not yet in a line
  for (const edge of edges) for (const k of edge.slice(0, 2)) open.set(k, (open.get(k) ?? new Set()).add(edge));
  const lines = [];
  for (const edge of edges) {
    if (!open.get(edge[0]).has(edge)) continue;
    const line = [edge[0]];
    for (let next = edge; next; [next] = open.get(line.at(-1))) {
      const [a, b] = next;
      for (const k of [a, b]) open.get(k).delete(next);
      line.push(a === line.at(-1) ? b : a);
    }
    lines.push(line);
  }
  return lines;
}

/** Draw the sharp edges of a surface on the near or far side; on the near side also its outline. */
function paintEdges(painter, view, { color, width, hidden, dash }, near) {
  const { front } = view;
  const drawn = view.solid.edges.filter(([, , f, g, sharp]) =>
    sharp ? (front[f] || front[g]) === near : near && front[f] !== front[g]);
  painter.begin();
  for (const line of dash.length ? linesOf(drawn) : drawn) painter.trace(view, dash.length ? line : line.slice(0, 2));
  painter.stroke(color, near ? width : 1, near ? 1 : hidden, dash);
}

/** Draw a part of a plane: nearly clear, with a rim and hatching on the forbidden side. */
function paintSheet(painter, { corners, hatch }, { color, filled, alpha, width, dash, hidden }) {
  painter.begin();
  painter.polygon(corners);
  painter.fill(color, (filled ? 0.6 : 0.25) * alpha);
  painter.stroke(color, width, 0.9, dash);
  painter.begin();
  for (const [a, b] of hatch) painter.segment(a, b);
  painter.stroke(color, 1, Math.min(1, 2 * hidden));
}
