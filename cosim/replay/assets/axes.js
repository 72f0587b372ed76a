// Axes of a chart: time with a break, ticks at round numbers, the range that the curves need, and a curve as few strokes as pixels need.

const LONG_TAIL = 0.3; // part of the time from which on a tail in which nothing moves is drawn short
const SHORT_TAIL = 0.14; // part of the axis that it then takes

/** Where times stand along an axis: on a line, broken before a long tail in which nothing moves any more. */
class TimeAxis {
  /** @param {number[]} window [s]  @param {?number} rest when the tail begins [s]  @param {number} left, right ends */
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

/** Round numbers between two: at most about `most` of them. */
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

/** The texts of ticks: as many digits as tell them apart, k for thousands. */
function tickTexts(values) {
  const step = values.length > 1 ? Math.abs(values[1] - values[0]) : Math.abs(values[0]) || 1;
  const kilo = Math.max(...values.map(Math.abs)) >= 10000;
  const shown = kilo ? step / 1000 : step;
  const digits = Math.max(0, Math.min(9, -Math.floor(Math.log10(shown) + 1e-9)));
  return values.map((value) => {
    const text = Math.abs(kilo ? value / 1000 : value).toFixed(digits);
    return (value < 0 && Number(text) !== 0 ? "\u2212" : "") + text + (kilo && Number(text) !== 0 ? "k" : "");
  });
}

/** Rows of a run that a window of time needs: from the one before it to the one after it, [first, past the last]. */
function rowsIn(run, [from, to]) {
  if (!run.rows) return [0, 0];
  return [run.row(from), Math.min(run.rows, run.row(to) + 2)];
}

/**
 * The range of values that some curves have in a window of time; what is only for context does not stretch it far.
 *
 * @returns {?number[]} [low, high], with low < high, or null where there is no number
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
 * Put a curve on the path of a context: every row, or where rows are denser than pixels the first, least, greatest and
 * last of each pixel column, which looks the same. Where there is no number the line has a gap.
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
    if (alone(i)) context.lineTo(x + 1, toY(values[i])); // a single number between gaps is still seen
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
