// Labels of the scene without overlaps: important ones first, the others where space is left.

/** Placement and drawing of labels. */
class Labels {
  constructor(context) {
    this.context = context;
    this._sides = new Map(); // position of each label in the last frame, which is tried first
    this.begin(0, 0);
  }

  /** Remove all labels and set the size of the picture [CSS pixels]. */
  begin(width, height) {
    Object.assign(this, { width, height });
    this._words = [];
    this._taken = []; // boxes
    this.placed = []; // boxes of drawn labels: {of: {run, region} or null, x, y, width, height} [pixels]
  }

  /** Return the run and region whose label is at a pixel; null if there is none. */
  nameAt(x, y) {
    return this.placed.find((box) => box.of && overlap(box, { x, y, width: 0, height: 0 }))?.of ?? null;
  }

  /** Keep labels out of a rectangle [pixels]. */
  block(x, y, width, height) { this._taken.push({ x, y, width, height }); }

  /** Keep labels out of a square about a projected point [pixels]. */
  blockAround([x, y, depth], half) {
    if (depth > 0) this.block(x - half, y - half, 2 * half, 2 * half);
  }

  /**
   * Add a label for the next draw().
   * @param {object} word {key, text, x, y, color, rank: lower is more important, gap: pixels from the point, bold,
   * chip: background color or null, pad: pixels that stay free beside it, far: true if it may stand farther off, with
   * a leader line in the color `edge`, sides: of "above below right left here" in the order in which they are tried}
   */
  add(word) { this._words.push(word); }

  /** Draw all labels for which there is space. */
  draw() {
    const known = this._sides;
    this._sides = new Map();
    for (const word of this._words.sort((a, b) => a.rank - b.rank)) {
      const spots = (word.far ? [0, 24, 48, 80] : [0]).flatMap((off) => word.sides.map((side) => [side, off]));
      const before = spots.find((spot) => String(spot) === String(known.get(word.key)));
      if (before) spots.unshift(before);
      const size = this._sizeOf(word);
      const spot = spots.find((one) => this._isFree(boxAt(word, one, size), word.pad ?? 0));
      if (!spot) continue;
      const box = boxAt(word, spot, size);
      this.block(box.x - 2, box.y - 1, box.width + 4, box.height + 2);
      this._sides.set(word.key, spot);
      this.placed.push({ of: word.of ?? null, ...box, word, leads: spot[1] > 0 });
    }
    for (const box of this.placed.filter(({ leads }) => leads)) this._lead(box);
    for (const box of this.placed) this._write(box); // on top of all leader lines
  }

  /** Draw a leader line from a label to its point. */
  _lead({ word, x, y, width, height }) {
    const { context } = this;
    beginLines(context, [[word.x, word.y], [clamp(word.x, x, x + width), clamp(word.y, y, y + height)]]);
    Object.assign(context, { strokeStyle: word.edge, lineWidth: 1 });
    context.stroke();
  }

  _write({ word, x, y, width, height }) {
    const { context } = this;
    if (word.chip) fillRounded(context, word.chip, x, y, width, height, 4);
    if (word.chip && word.bold) {
      Object.assign(context, { strokeStyle: word.edge, lineWidth: 1.5 });
      context.stroke();
    }
    const style = { font: fontOf(word), fillStyle: word.color, textAlign: "left", textBaseline: "middle" };
    writeText(context, word.text, x + (word.chip ? 5 : 1), y + 0.5 * height + 0.5, style);
  }

  _isFree({ x, y, width, height }, pad) {
    if (x - pad < 2 || y < 2 || x + width + pad > this.width - 2 || y + height > this.height - 2) return false;
    const padded = { x: x - pad, y, width: width + 2 * pad, height };
    return !this._taken.some((box) => overlap(box, padded));
  }

  _sizeOf(word) {
    this.context.font = fontOf(word);
    const { width } = this.context.measureText(word.text);
    const height = word.size ?? 12;
    return word.chip ? [width + 10, height + 7] : [width + 2, height + 2];
  }
}

const fontOf = ({ bold, size = 12 }) => `${bold ? "600 " : ""}${size}px system-ui, sans-serif`;

const overlap = (a, b) =>
  a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;

/** Return the box of a label at a side of its point, at a distance beyond its gap. */
function boxAt(word, [side, off], [width, height]) {
  const gap = word.gap + off;
  const [dx, dy] = {
    above: [-0.5 * width, -gap - height], below: [-0.5 * width, gap],
    right: [gap, -0.5 * height], left: [-gap - width, -0.5 * height], here: [-0.5 * width, -0.5 * height],
  }[side];
  return { x: word.x + dx, y: word.y + dy, width, height };
}
