// Current at the vehicles: an arrow as the camera sees its direction, with speed and course as text.

const ARROW = 24; // pixels, length of the arrow of a current across the line of sight

/** Paint the currents beside the compass, in a narrow picture above it: equal ones of several runs once, none at rest. */
function paintCurrents(painter, labels, colours, runs, t) {
  const names = runNames(runs);
  const byWords = new Map();
  runs.forEach((run, i) => {
    const current = run.current(t);
    if (!current) return;
    const words = currentWords(current);
    byWords.set(words, { current, names: [...(byWords.get(words)?.names ?? []), names[i]] });
  });
  const { context, camera } = painter;
  const narrow = camera.width < 560;
  const x = narrow ? 46 : 112;
  let y = camera.height - (narrow ? 112 : 24);
  for (const [words, { current, names: whose }] of byWords) {
    const text = `current ${words}${whose.length < runs.length ? `, ${whose.join(", ")}` : ""}`;
    context.font = "600 12px system-ui, sans-serif";
    const width = Math.min(context.measureText(text).width, camera.width - x - 44);
    context.fillStyle = colours.chip;
    context.beginPath();
    context.roundRect(x - 20, y - 16, width + 56, 32, 6);
    context.fill();
    labels.block(x - 20, y - 16, width + 56, 32);
    const along = Vec.unit(current);
    const [dx, dy] = [0.5 * ARROW * Vec.dot(along, camera.right), -0.5 * ARROW * Vec.dot(along, camera.up)];
    context.beginPath();
    addArrow(context, [x - dx, y - dy], [x + dx, y + dy], 9);
    context.lineCap = "round";
    painter.stroke(colours.water, 2.6);
    context.lineCap = "butt";
    context.fillStyle = colours.ink;
    context.textAlign = "left";
    context.textBaseline = "middle";
    context.fillText(text, x + 26, y + 0.5, width);
    y -= 36;
  }
}
