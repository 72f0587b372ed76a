// Scrubber: a ribbon of the active regions, marks of events, and the cursor.

/** Return the events of a run as marks; without events in the header, the goal of the summary. */
function marksOf({ header: { events, summary } }) {
  const time = summary?.reach_time;
  return events ?? (Number.isFinite(time) ? [{ time, kind: "goal", text: "goal reached" }] : []);
}

/** Scrubber of the selected run. */
class Timeline {
  constructor(player) {
    this.player = player;
    this.input = byId("scrubber");
    this.canvas = byId("ribbon");
    this.axis = new TimeAxis([0, 1], null, 0, 1);
    this.input.oninput = () => player.seek(this.axis.time(Number(this.input.value)));
    new ResizeObserver(() => this.paint()).observe(this.canvas);
  }

  setRun(run) {
    this.run = run;
    this.grown();
  }

  /** Update after rows were appended or the run was replaced. */
  grown() {
    const { start, end, rest } = this.player;
    this.axis = new TimeAxis([start, Math.max(end, start + 1e-9)], rest, 0, 1); // positions from 0 to 1
    const marks = (this.run ? marksOf(this.run) : []).slice(0, 200).map(({ time, kind, text }) => {
      // keyboard users have keys and the list of events
      const props = { title: `${clock(time)}: ${text}`, onclick: () => this.player.seek(time) };
      return h(`span.mark-at.${kind}`, { ...props, style: `left: ${100 * this.axis.x(time)}%` });
    });
    byId("marks").replaceChildren(...marks);
    this.paint();
    this.point();
  }

  /** Move the cursor. */
  point() {
    const { t, end, playing, live } = this.player;
    const part = clamp(this.axis.x(t), 0, 1); // the axis of a live run is a little behind its cursor
    this.input.value = part;
    this.input.parentElement.style.setProperty("--part", part.toFixed(5));
    setText(byId("clock"), `${clock(t)} / ${clock(end, 1)}`);
    // screen readers announce it only when the cursor rests
    const who = this.run ? `, ${activeWords(this.run, t).name} active` : "";
    if (!playing && !live) this.input.ariaValueText = clock(t) + who;
  }

  /** Paint the ribbon: the color of the active region in full height, violations as notches below. */
  paint() {
    const { context, width, height } = clearedCanvas(this.canvas);
    context.fillStyle = COLORS.grid;
    context.fillRect(0, 0, width, height);
    const active = this.run?.column("active");
    if (!active || this.run.rows < 2) return;
    const { time, header } = this.run;
    const x = (t) => this.axis.x(t) * width;
    const bar = (from, to, top, least) =>
      context.fillRect(x(from), top, Math.max(least, x(to) - x(from)), height - top);
    for (const { from, until, value } of stretches(active)) {
      const { color, criterion } = header.regions[value] ?? { color: COLORS.grid };
      Object.assign(context, { fillStyle: color, globalAlpha: criterion ? 1 : 0.45 });
      bar(time[from], time[until], 0, 1);
    }
    Object.assign(context, { fillStyle: COLORS.ink, globalAlpha: 1, strokeStyle: COLORS.card, lineWidth: 2.5 });
    for (const { name } of header.regions.filter(({ criterion }) => criterion)) {
      for (const [from, until] of below(this.run, `${name}.clearance`)) bar(from, until, height - 4, 2);
    }
    if (!this.axis.broken) return;
    const breakX = x(this.axis.rest); // after these cuts, time is compressed
    beginLines(context, ...[breakX - 3, breakX + 3].map((cut) => [[cut - 3, height], [cut + 3, 0]]));
    context.stroke();
  }
}
