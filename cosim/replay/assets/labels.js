// Labels of the scene without overlaps: important ones first, the others where space is left.

/** Placement and drawing of labels. */
class Labels {
  constructor(context) {
    this.context = context;
    this._widths = new Map();
    this._sides = new Map(); // position of each label in the last frame, which is tried first
    this.begin(0, 0);
  }

  /** Remove all labels and set the size of the picture [CSS pixels]. */
  begin(width, height) {
    this.width = width;
    this.height = height;
    this._words = [];
    this._taken = [];
    this.placed = []; // boxes of drawn labels: {of: {run, region} or null, x, y, width, height} [pixels]
  }

  /** Return the run and region whose label is at a pixel; null if there is none. */
  nameAt(x, y) {
    const inside = (box) => x >= box.x && x <= box.x + box.width && y >= box.y && y <= box.y + box.height;
    return this.placed.find((box) => box.of && inside(box))?.of ?? null;
  }

  /** Keep labels out of a rectangle [pixels]. */
  block(x, y, width, height) {
    this._taken.push([x, y, x + width, y + height]);
  }

  /**
   * Add a label for the next draw().
   * @param {object} word {key, text, x, y, colour, rank: lower is more important, gap: pixels from the point, bold, chip:
   * background color or null, pad: pixels that stay free beside it, far: true if it may stand farther off, with a leader
   * line in the color `edge`, sides: of "above below right left here" in the order in which they are tried}
   */
  add(word) {
    this._words.push(word);
  }

  /** Draw all labels for which there is space. */
  draw() {
    const { context } = this;
    const known = this._sides;
    this._sides = new Map();
    context.textBaseline = "middle";
    context.textAlign = "left";
    this._words.sort((a, b) => a.rank - b.rank);
    const written = [];
    for (const word of this._words) {
      const font = `${word.bold ? "600 " : ""}${word.size ?? 12}px system-ui, sans-serif`;
      const width = this._width(word.text, font) + (word.chip ? 10 : 2);
      const height = (word.size ?? 12) + (word.chip ? 7 : 2);
      const before = known.get(word.key);
      const spots = (word.far ? [0, 24, 48, 80] : [0]).flatMap((off) => word.sides.map((side) => [side, off]));
      if (before && spots.some(([side, off]) => side === before[0] && off === before[1])) spots.unshift(before);
      for (const [side, off] of spots) {
        const [x, y] = this._corner(side, word.gap + off, word, width, height);
        const pad = word.pad ?? 0;
        if (!this._free(x - pad, y, width + 2 * pad, height)) continue;
        this._taken.push([x - 2, y - 1, x + width + 2, y + height + 1]);
        this._sides.set(word.key, [side, off]);
        this.placed.push({ of: word.of ?? null, x, y, width, height });
        if (off) this._lead(word, x, y, width, height);
        written.push([word, font, x, y, width, height]);
        break;
      }
    }
    for (const placed of written) this._write(...placed); // on top of all leader lines
  }

  /** Draw a leader line from a label to its point. */
  _lead(word, x, y, width, height) {
    const { context } = this;
    context.beginPath();
    context.moveTo(word.x, word.y);
    context.lineTo(Math.min(x + width, Math.max(x, word.x)), Math.min(y + height, Math.max(y, word.y)));
    context.strokeStyle = word.edge;
    context.lineWidth = 1;
    context.stroke();
  }

  _write(word, font, x, y, width, height) {
    const { context } = this;
    context.font = font;
    if (word.chip) {
      context.fillStyle = word.chip;
      context.beginPath();
      context.roundRect(x, y, width, height, 4);
      context.fill();
      if (word.bold) {
        context.strokeStyle = word.edge;
        context.lineWidth = 1.5;
        context.stroke();
      }
    }
    context.fillStyle = word.colour;
    context.fillText(word.text, x + (word.chip ? 5 : 1), y + 0.5 * height + 0.5);
  }

  _corner(side, gap, { x, y }, width, height) {
    if (side === "above") return [x - 0.5 * width, y - gap - height];
    if (side === "below") return [x - 0.5 * width, y + gap];
    if (side === "right") return [x + gap, y - 0.5 * height];
    if (side === "left") return [x - gap - width, y - 0.5 * height];
    return [x - 0.5 * width, y - 0.5 * height];
  }

  _free(x, y, width, height) {
    if (x < 2 || y < 2 || x + width > this.width - 2 || y + height > this.height - 2) return false;
    return !this._taken.some((box) => x < box[2] && x + width > box[0] && y < box[3] && y + height > box[1]);
  }

  _width(text, font) {
    const key = `${font}|${text}`;
    if (!this._widths.has(key)) {
      if (this._widths.size > 2000) this._widths.clear();
      this.context.font = font;
      this._widths.set(key, this.context.measureText(text).width);
    }
    return this._widths.get(key);
  }
}
