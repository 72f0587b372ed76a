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
    const at = this.broken ? right - SHORT_TAIL * (right - left) : right;
    const across = (at - left) / Math.max(this.rest - from, 1e-9);
    const behind = (right - at) / Math.max(to - this.rest, 1e-9);
    this.x = (t) => (this.broken && t > rest ? at + (t - rest) * behind : left + (t - from) * across);
    this.time = (x) => (this.broken && x > at ? rest + (x - at) / behind : from + (x - left) / across);
  }
}

/** Return the multiples of a round step from low to high, at most about `most` of them. */
function ticks(low, high, most) {
  const span = high - low;
  if (!(span > 0) || !Number.isFinite(span)) return [low];
  const rough = span / Math.max(1, most);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((x) => x * power).find((x) => x >= rough);
  const first = Math.ceil(low / step - 1e-9);
  const count = Math.floor(high / step + 1e-9) - first;
  return Array.from({ length: count + 1 }, (_, i) => (first + i) * step);
}

/** Return tick labels with just enough digits to differ; thousands as k from 10000 on. */
function tickTexts(values) {
  const step = values.length > 1 ? Math.abs(values[1] - values[0]) : Math.abs(values[0]) || 1;
  const kilo = Math.max(...values.map(Math.abs)) >= 10000;
  const shown = kilo ? step / 1000 : step;
  const digits = Math.max(0, Math.min(9, -Math.floor(Math.log10(shown) + 1e-9)));
  return values.map((value) => {
    const text = decimals(kilo ? value / 1000 : value, digits);
    return text + (kilo && Number(text) !== 0 ? "k" : "");
  });
}

/** Return the rows that cover a time window, one beyond on each side: [first, past the last]. */
function rowsIn(run, [from, to]) {
  if (!run.rows) return [0, 0];
  return [run.row(from), Math.min(run.rows, run.row(to) + 2)];
}

/**
 * Return the range of values of some curves in a time window, with a margin.
 *
 * Context curves widen the range only if they lie within two spans of the other curves. `zero` includes the value 0.
 *
 * @returns {?number[]} [low, high], with low < high; null if there is no number
 */
function rangeOf(curves, window, zero) {
  const extent = (some) => {
    let [low, high] = [Infinity, -Infinity];
    for (const { run, values } of some) {
      const [first, last] = rowsIn(run, window);
      for (let i = first; i < last; i++) {
        if (values[i] < low && values[i] !== -Infinity) low = values[i];
        if (values[i] > high && values[i] !== Infinity) high = values[i];
      }
    }
    return [low, high];
  };
  let [low, high] = extent(curves.filter((curve) => !curve.signal.context));
  if (!(low <= high)) [low, high] = extent(curves);
  if (!(low <= high)) return null;
  const room = Math.max(high - low, 1e-9);
  for (const curve of curves.filter((one) => one.signal.context)) {
    const [least, most] = extent([curve]);
    if (least >= low - 2 * room && most <= high + 2 * room) [low, high] = [Math.min(low, least), Math.max(high, most)];
  }
  if (zero) [low, high] = [Math.min(low, 0), Math.max(high, 0)];
  const pad = high - low > 1e-9 ? 0.06 * (high - low) : 0.5 * Math.abs(high) || 1;
  return [low - pad, high + pad];
}

/**
 * Add a curve to the path of a context.
 *
 * Where rows are denser than pixels, only the first, least, greatest and last value of each pixel column are drawn.
 * Numbers that are not finite leave a gap.
 */
function traceCurve(context, { run, values }, window, toX, toY) {
  const [first, last] = rowsIn(run, window);
  const time = run.time;
  let pen = false;
  const point = (x, value) => {
    if (pen) context.lineTo(x, toY(value));
    else context.moveTo(x, toY(value));
    pen = true;
  };
  const alone = (i) => !Number.isFinite(values[i + 1]) && (i === first || !Number.isFinite(values[i - 1]));
  const dense = last - first > 3 * Math.abs(toX(window[1]) - toX(window[0]));
  context.beginPath();
  for (let i = first; i < last; ) {
    if (!Number.isFinite(values[i])) {
      pen = false;
      i += 1;
      continue;
    }
    const x = toX(time[i]);
    point(x, values[i]);
    if (alone(i)) context.lineTo(x + 1, toY(values[i])); // a single number between gaps stays visible
    let [low, high, end] = [values[i], values[i], values[i]];
    i += 1;
    if (!dense) continue;
    const column = Math.floor(x);
    for (; i < last && Number.isFinite(values[i]) && Math.floor(toX(time[i])) === column; i++) {
      end = values[i];
      if (end < low) low = end;
      else if (end > high) high = end;
    }
    if (low < high) for (const value of [low, high, end]) point(x, value);
  }
}
