// Static part of a chart: grid, axes, violation zone, curves. The cursor is an element over it.

const MARGIN = { left: 50, right: 10, top: 8, bottom: 20 };
const FONT = "11px system-ui, sans-serif";

/** Return the page's colors of the current theme, for a canvas. */
function pageColours() {
  const style = getComputedStyle(document.documentElement);
  const of = (name) => style.getPropertyValue(name).trim();
  return { ink: of("--ink"), muted: of("--muted"), grid: of("--grid"), zone: of("--zone"), bad: of("--bad"), card: of("--card") };
}

/** Placement of a plot in its canvas [CSS pixels], and its scales of time and value. */
class Frame {
  constructor(width, height, window, rest, range, down) {
    Object.assign(this, { width, height, window, range });
    this.left = MARGIN.left;
    this.right = width - MARGIN.right;
    this.top = MARGIN.top;
    this.bottom = height - MARGIN.bottom;
    this.axis = new TimeAxis(window, rest, this.left, this.right);
    this.x = this.axis.x;
    this.time = (x) => this.axis.time(Math.min(this.right, Math.max(this.left, x)));
    const [low, high] = range ?? [0, 1];
    const up = (this.bottom - this.top) / (high - low);
    this.y = down ? (value) => this.top + (value - low) * up : (value) => this.bottom - (value - low) * up;
  }
}

/** Paint a plot without its cursor. */
function paintPlot(context, frame, spec, curves, theme) {
  const colours = pageColours();
  context.clearRect(0, 0, frame.width, frame.height);
  context.font = FONT;
  context.lineJoin = "round";
  if (!frame.range) {
    context.fillStyle = colours.muted;
    context.textAlign = "center";
    context.fillText("no numbers in this window", (frame.left + frame.right) / 2, (frame.top + frame.bottom) / 2);
    return;
  }
  if (spec.zero) paintZone(context, frame, colours);
  paintAxes(context, frame, spec, colours);
  context.save();
  context.beginPath();
  context.rect(frame.left, frame.top - 1, frame.right - frame.left, frame.bottom - frame.top + 2);
  context.clip();
  for (const curve of [...curves].sort((a, b) => b.signal.faint - a.signal.faint)) {
    context.strokeStyle = hueColour(curve.signal.hue, theme, curve.signal.shade);
    context.lineWidth = curve.signal.faint ? 0.8 : 1.6;
    context.globalAlpha = curve.signal.faint ? 0.75 : 1;
    context.setLineDash(curve.dash);
    traceCurve(context, curve, frame.window, frame.x, frame.y);
    context.stroke();
  }
  context.restore();
  if (spec.zero) nameZone(context, frame, colours);
  if (frame.axis.broken) nameRest(context, frame, curves, colours);
  paintBeyond(context, frame, spec, curves, theme, colours.card);
}

/** Paint the zone below zero, where a region is violated. */
function paintZone(context, frame, colours) {
  const zero = Math.min(frame.bottom, Math.max(frame.top, frame.y(0)));
  context.fillStyle = colours.zone;
  context.fillRect(frame.left, zero, frame.right - frame.left, frame.bottom - zero);
}

/** Write the name of the zone over the curves. */
function nameZone(context, frame, colours) {
  if (frame.bottom - frame.y(0) < 16) return;
  context.textAlign = "right";
  context.textBaseline = "bottom";
  paintText(context, "below 0: violated (goal: outside)", frame.right - 4, frame.bottom - 3, colours.bad, colours.card);
}

/** Draw a text with an outline in the background color, so that it is legible over curves. */
function paintText(context, text, x, y, colour, ground) {
  context.lineWidth = 4;
  context.strokeStyle = ground;
  context.strokeText(text, x, y);
  context.fillStyle = colour;
  context.fillText(text, x, y);
}

function paintAxes(context, frame, spec, colours) {
  const scale = spec.unit === "rad" ? DEGREES : 1;
  const [low, high] = frame.range;
  const heights = ticks(low * scale, high * scale, Math.max(2, (frame.bottom - frame.top) / 20));
  const { axis } = frame;
  const across = ticks(frame.window[0], axis.rest, Math.max(2, (frame.x(axis.rest) - frame.left) / 70));
  context.lineWidth = 1;
  context.strokeStyle = colours.grid;
  context.fillStyle = colours.muted;
  context.textAlign = "right";
  context.textBaseline = "middle";
  context.beginPath();
  const words = tickTexts(heights);
  heights.forEach((value, i) => {
    const y = Math.round(frame.y(value / scale)) + 0.5;
    context.moveTo(frame.left, y);
    context.lineTo(frame.right, y);
    context.fillText(words[i], frame.left - 6, y);
  });
  for (const t of across) {
    const x = Math.round(frame.x(t)) + 0.5;
    context.moveTo(x, frame.top);
    context.lineTo(x, frame.bottom);
  }
  context.stroke();
  context.textBaseline = "top";
  const times = tickTexts(across);
  if (axis.broken) {
    across.push(frame.window[1]);
    times.push(String(Number(frame.window[1].toFixed(1))));
  }
  across.forEach((t, i) => {
    const last = i === across.length - 1;
    const text = last ? `${times[i]} s` : times[i];
    const half = context.measureText(text).width / 2;
    context.textAlign = "center";
    context.fillText(text, Math.min(frame.x(t), frame.width - half - 1), frame.bottom + 5);
  });
  if (axis.broken) paintBreak(context, frame, colours);
  if (low < 0 && high > 0) {
    context.strokeStyle = colours.muted;
    context.beginPath();
    const y = Math.round(frame.y(0)) + 0.5;
    context.moveTo(frame.left, y);
    context.lineTo(frame.right, y);
    context.stroke();
  }
}

/** Mark the break of the time axis; nothing moves after it. */
function paintBreak(context, { axis, x, top, bottom, right }, colours) {
  const at = x(axis.rest);
  context.fillStyle = colours.grid;
  context.globalAlpha = 0.45;
  context.fillRect(at, top, right - at, bottom - top);
  context.globalAlpha = 1;
  context.strokeStyle = colours.muted;
  context.lineWidth = 1.5;
  context.beginPath();
  for (const aside of [-2, 2]) {
    context.moveTo(at + aside - 2.5, bottom + 4);
    context.lineTo(at + aside + 2.5, bottom - 4);
  }
  context.stroke();
  context.lineWidth = 1;
}

/** Write "at rest" after the break of the time axis: at the top, in the middle or at the bottom, where no curve is. */
function nameRest(context, frame, curves, colours) {
  const { axis, top, bottom, right } = frame;
  const at = frame.x(axis.rest);
  if (right - at <= 40) return;
  const lines = curves.filter(({ values }) => values.length).map(({ values }) => frame.y(values[values.length - 1]));
  const free = [top + 8, (top + bottom) / 2, bottom - 24].find((y) => lines.every((line) => !(Math.abs(line - y) < 10)));
  if (free === undefined) return;
  context.textAlign = "center";
  context.textBaseline = "middle";
  paintText(context, "at rest", (at + right) / 2, free, colours.muted, colours.card);
}

/** Write the true values that lie beyond the range of the curves, a line of text each, with an arrow. */
function paintBeyond(context, frame, spec, curves, theme, ground) {
  let line = 0;
  for (const { signal: of, values } of curves.filter((curve) => curve.signal.context && curve.values.length)) {
    const [low, high] = frame.range;
    if (values[0] >= low && values[0] <= high) continue;
    context.textAlign = "right";
    context.textBaseline = "top";
    const text = `${of.label} is at ${quantity(values[0], spec.unit)} ${values[0] > high ? "↑" : "↓"}`;
    paintText(context, text, frame.right - 4, frame.top + 2 + 14 * line, hueColour(of.hue, theme, of.shade), ground);
    line += 1;
  }
}
