// Current at the vehicles: an arrow as the camera sees its direction, with speed and course as text.

const ARROW = 24; // pixels, length of the arrow of a current across the line of sight

/** Paint the currents beside the compass, in a narrow picture above it: equal ones once, none at rest. */
function paintCurrents(painter, labels, runs, t) {
  const names = runNames(runs);
  const byWords = new Map(); // current, and names of the runs
  runs.forEach((run, i) => {
    const current = run.current(t);
    if (!current) return;
    const words = currentWords(current);
    byWords.set(words, [current, ...(byWords.get(words)?.slice(1) ?? []), names[i]]);
  });
  const { context, camera } = painter;
  const narrow = camera.width < 560;
  const x = narrow ? 46 : 112;
  let y = camera.height - (narrow ? 112 : 24);
  for (const [words, [current, ...whose]] of byWords) {
    const text = `current ${words}${whose.length < runs.length ? `, ${whose.join(", ")}` : ""}`;
    context.font = "600 12px system-ui, sans-serif";
    const width = Math.min(context.measureText(text).width, camera.width - x - 44);
    fillRounded(context, COLORS.chip, x - 20, y - 16, width + 56, 32, 6);
    labels.block(x - 20, y - 16, width + 56, 32);
    const along = Vec.scale(Vec.unit(current), 0.5 * ARROW);
    const [dx, dy] = [Vec.dot(along, camera.right), -Vec.dot(along, camera.up)];
    context.lineCap = "round";
    painter.strokeLines(arrowLines([x - dx, y - dy], [x + dx, y + dy], 9), COLORS.accent, 2.6);
    Object.assign(context, { lineCap: "butt", fillStyle: COLORS.ink, textAlign: "left", textBaseline: "middle" });
    context.fillText(text, x + 26, y + 0.5, width);
    y -= 36;
  }
}
