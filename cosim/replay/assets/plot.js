// Static part of a chart: grid, axes, violation zone, curves. The cursor is an element over it.

const MARGIN = { left: 50, right: 10, top: 8, bottom: 20 };
const FONT = "11px system-ui, sans-serif";

/** Placement of a plot in its canvas [CSS pixels], and its scales of time and value. */
class Frame {
  constructor(width, height, window, rest, range, down) {
    const [left, right, top, bottom] = [MARGIN.left, width - MARGIN.right, MARGIN.top, height - MARGIN.bottom];
    Object.assign(this, { width, height, window, range, left, right, top, bottom });
    this.axis = new TimeAxis(window, rest, left, right);
    this.x = this.axis.x;
    this.time = (x) => this.axis.time(clamp(x, left, right));
    const [low, high] = range ?? [0, 1];
    const scale = (bottom - top) / (high - low);
    this.y = down ? (value) => top + (value - low) * scale : (value) => bottom - (value - low) * scale;
  }
}

/** Paint a plot without its cursor. */
function paintPlot(context, frame, spec, curves) {
  const { left, right, top, bottom, range, window, x, y } = frame;
  Object.assign(context, { font: FONT, lineJoin: "round" });
  if (!range) {
    const style = { fillStyle: COLORS.muted, textAlign: "center" };
    writeText(context, "no numbers in this window", (left + right) / 2, (top + bottom) / 2, style);
    return;
  }
  if (spec.zero) {
    const zero = clamp(y(0), top, bottom);
    context.fillStyle = COLORS.zone;
    context.fillRect(left, zero, right - left, bottom - zero);
  }
  paintAxes(context, frame, spec);
  context.save();
  context.beginPath();
  context.rect(left, top - 1, right - left, bottom - top + 2);
  context.clip();
  for (const curve of [...curves].sort((a, b) => b.signal.faint - a.signal.faint)) {
    const { hue, shade, faint } = curve.signal;
    const [lineWidth, globalAlpha] = faint ? [0.8, 0.75] : [1.6, 1];
    Object.assign(context, { strokeStyle: hueColor(hue, shade), lineWidth, globalAlpha });
    context.setLineDash(curve.dash);
    traceCurve(context, curve, window, x, y);
    context.stroke();
  }
  context.restore();
  if (spec.zero && bottom - y(0) >= 16) {
    const style = { textAlign: "right", textBaseline: "bottom", fillStyle: COLORS.bad };
    writeOutlined(context, "below 0: violated (goal: outside)", right - 4, bottom - 3, style);
  }
  if (frame.axis.broken) nameRest(context, frame, curves);
  paintBeyond(context, frame, spec, curves);
}

/** Draw a text with an outline in the background color, so that it is legible over curves. */
function writeOutlined(context, text, x, y, style) {
  Object.assign(context, style, { lineWidth: 4, strokeStyle: COLORS.card });
  context.strokeText(text, x, y);
  context.fillText(text, x, y);
}

function paintAxes(context, { left, right, top, bottom, range, window, width, axis, x, y }, { unit }) {
  const scale = unit === "rad" ? DEGREES : 1;
  const [low, high] = range.map((value) => value * scale);
  const heights = ticks(low, high, Math.max(2, (bottom - top) / 20));
  const times = ticks(window[0], axis.rest, Math.max(2, (x(axis.rest) - left) / 70));
  const rowOf = (value) => Math.round(y(value / scale)) + 0.5;
  const level = (value) => [[left, rowOf(value)], [right, rowOf(value)]];
  const upright = (t) => [top, bottom].map((end) => [Math.round(x(t)) + 0.5, end]);
  beginLines(context, ...heights.map(level), ...times.map(upright));
  Object.assign(context, { lineWidth: 1, strokeStyle: COLORS.grid, fillStyle: COLORS.muted });
  context.stroke();
  const style = { textAlign: "right", textBaseline: "middle" };
  tickTexts(heights).forEach((text, i) => writeText(context, text, left - 6, rowOf(heights[i]), style));
  const texts = tickTexts(times);
  if (axis.broken) {
    times.push(window[1]);
    texts.push(String(Number(window[1].toFixed(1))));
  }
  texts.push(`${texts.pop()} s`);
  times.forEach((t, i) => {
    const half = context.measureText(texts[i]).width / 2;
    const textX = Math.min(x(t), width - half - 1);
    writeText(context, texts[i], textX, bottom + 5, { textAlign: "center", textBaseline: "top" });
  });
  context.strokeStyle = COLORS.muted;
  if (axis.broken) {
    const breakX = x(axis.rest); // nothing moves after it
    Object.assign(context, { fillStyle: COLORS.grid, globalAlpha: 0.45, lineWidth: 1.5 });
    context.fillRect(breakX, top, right - breakX, bottom - top);
    context.globalAlpha = 1;
    beginLines(context, ...[breakX - 2, breakX + 2].map((cut) => [[cut - 2.5, bottom + 4], [cut + 2.5, bottom - 4]]));
    context.stroke();
    context.lineWidth = 1;
  }
  if (low < 0 && high > 0) {
    beginLines(context, level(0));
    context.stroke();
  }
}

/** Write "at rest" after the break of the time axis: at the top, in the middle or at the bottom, where no curve is. */
function nameRest(context, { axis, x, y, top, bottom, right }, curves) {
  const breakX = x(axis.rest);
  const lines = curves.map(({ values }) => y(values.at(-1)));
  const rows = [top + 8, (top + bottom) / 2, bottom - 24];
  const free = rows.find((row) => !lines.some((line) => Math.abs(line - row) < 10));
  if (free === undefined || right - breakX <= 40) return;
  const style = { textAlign: "center", textBaseline: "middle", fillStyle: COLORS.muted };
  writeOutlined(context, "at rest", (breakX + right) / 2, free, style);
}

/** Write the true values that lie beyond the range of the curves, a line of text each, with an arrow. */
function paintBeyond(context, { range: [low, high], right, top }, { unit }, curves) {
  const beyond = curves.filter(({ signal: { context: isContext }, values: [value] }) =>
    isContext && (value < low || value > high));
  beyond.forEach(({ signal: { label, hue, shade }, values: [value] }, line) => {
    const text = `${label} is at ${quantity(value, unit)} ${value > high ? "↑" : "↓"}`;
    const style = { textAlign: "right", textBaseline: "top", fillStyle: hueColor(hue, shade) };
    writeOutlined(context, text, right - 4, top + 2 + 14 * line, style);
  });
}
