// Axes of a chart: time with a break, round ticks, the range of values, and curves that are reduced to the pixels.

const LONG_TAIL = 0.3; // share of the window above which a final rest is compressed
const SHORT_TAIL = 0.14; // share of the axis that a compressed rest takes

/** Linear time axis that compresses a long final rest behind a break. */
class TimeAxis {
  /**
   * @param {number[]} window [from, to] [s]  @param {?number} rest start of the final rest [s]
   * @param {number} left, right ends of the axis
   */
  constructor([from, to], rest, left, right) {
    this.broken = rest !== null && rest > from && to - rest > LONG_TAIL * (to - from);
    this.rest = this.broken ? rest : to;
    const breakX = this.broken ? right - SHORT_TAIL * (right - left) : right;
    const across = (breakX - left) / Math.max(this.rest - from, 1e-9);
    const behind = (right - breakX) / Math.max(to - this.rest, 1e-9);
    this.x = (t) => (this.broken && t > rest ? breakX + (t - rest) * behind : left + (t - from) * across);
    this.time = (x) => (this.broken && x > breakX ? rest + (x - breakX) / behind : from + (x - left) / across);
  }
}

/** Return the least of 1, 2 or 5 times a power of ten that is not below `least`. */
function roundStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return power * [1, 2, 5, 10].find((k) => k * power >= least * (1 - 1e-9));
}

/** Return the multiples of a step within two bounds. */
function multiples(low, high, step) {
  const from = Math.ceil(low / step - 1e-6);
  const to = Math.floor(high / step + 1e-6);
  return Array.from({ length: Math.max(0, to - from + 1) }, (_, i) => (from + i) * step);
}

/** Return the digits after the point that multiples of a step need. */
const digitsOf = (step) => clamp(-Math.floor(Math.log10(step) + 1e-9), 0, 9);

/** Return round values from low to high, at most about `most` of them. */
function ticks(low, high, most) {
  const span = high - low;
  return span > 0 && Number.isFinite(span) ? multiples(low, high, roundStep(span / Math.max(1, most))) : [low];
}

/** Return tick labels with just enough digits to differ; thousands as k from 10000 on. */
function tickTexts(values) {
  const step = values.length > 1 ? Math.abs(values[1] - values[0]) : Math.abs(values[0]) || 1;
  const scale = Math.max(...values.map(Math.abs)) >= 10000 ? 1000 : 1;
  return values.map((value) => {
    const text = decimals(value / scale, digitsOf(step / scale));
    return text + (scale > 1 && Number(text) !== 0 ? "k" : "");
  });
}

/** Return the rows that cover a time window, one beyond on each side: [first, past the last]. */
const rowsIn = (run, [from, to]) => (run.rows ? [run.row(from), Math.min(run.rows, run.row(to) + 2)] : [0, 0]);

/** Return the minimum and the maximum finite value of some curves in a time window. */
function extentIn(curves, window) {
  let [low, high] = [Infinity, -Infinity];
  for (const { run, values } of curves) {
    for (const value of values.subarray(...rowsIn(run, window))) {
      if (value < low && value !== -Infinity) low = value;
      if (value > high && value !== Infinity) high = value;
    }
  }
  return [low, high];
}

/**
 * Return the range of values of some curves in a time window, with a margin.
 *
 * Context curves widen the range only if they lie within two spans of the other curves. `zero` includes the value 0.
 *
 * @returns {?number[]} [low, high], with low < high; null if there is no number
 */
function rangeOf(curves, window, zero) {
  let [low, high] = extentIn(curves.filter((curve) => !curve.signal.context), window);
  if (!(low <= high)) [low, high] = extentIn(curves, window);
  if (!(low <= high)) return null;
  const span = Math.max(high - low, 1e-9);
  const widen = (least, most) => {
    [low, high] = [Math.min(low, least), Math.max(high, most)];
  };
  for (const curve of curves.filter((one) => one.signal.context)) {
    const [least, most] = extentIn([curve], window);
    if (least >= low - 2 * span && most <= high + 2 * span) widen(least, most);
  }
  if (zero) widen(0, 0);
  const pad = high - low > 1e-9 ? 0.06 * (high - low) : 0.5 * Math.abs(high) || 1;
  return [low - pad, high + pad];
}

/**
 * Add a curve to the path of a context.
 *
 * Where rows are denser than pixels, only the first, minimum, maximum and last value of each pixel column are drawn.
 * Numbers that are not finite leave a gap.
 */
function traceCurve(context, { run, values }, window, toX, toY) {
  const [first, last] = rowsIn(run, window);
  const { time } = run;
  const dense = last - first > 3 * Math.abs(toX(window[1]) - toX(window[0]));
  context.beginPath();
  let pen = false;
  const point = (x, value) => {
    if (pen) context.lineTo(x, toY(value));
    else context.moveTo(x, toY(value));
    pen = true;
  };
  for (let i = first; i < last; i++) {
    if (!Number.isFinite(values[i])) {
      pen = false;
      continue;
    }
    const x = toX(time[i]);
    const alone = !pen && !Number.isFinite(values[i + 1]);
    point(x, values[i]);
    if (alone) point(x + 1, values[i]); // a single number between gaps stays visible
    const column = Math.floor(x);
    let [low, high] = [values[i], values[i]];
    const goesOn = () => i + 1 < last && Number.isFinite(values[i + 1]) && Math.floor(toX(time[i + 1])) === column;
    while (dense && goesOn()) {
      i += 1;
      [low, high] = [Math.min(low, values[i]), Math.max(high, values[i])];
    }
    if (low < high) for (const value of [low, high, values[i]]) point(x, value);
  }
}
