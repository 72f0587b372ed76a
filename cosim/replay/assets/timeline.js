// Scrubber: a ribbon of the active regions, marks of events, and the cursor.

const REACHED = "goal reached";

/** Return the events of a run as marks; without events in the header, the goal of the summary. */
function marksOf(run) {
  const { events, summary } = run.header;
  if (events) return events;
  const marks = [];
  if (Number.isFinite(summary?.reach_time)) marks.push({ time: summary.reach_time, kind: "goal", text: REACHED });
  return marks;
}

/** Paint two oblique cuts through the ribbon, after which time is compressed. */
function paintGap(context, x, height) {
  context.strokeStyle = pageColours().card;
  context.lineWidth = 2.5;
  context.beginPath();
  for (const aside of [-3, 3]) {
    context.moveTo(x + aside - 3, height);
    context.lineTo(x + aside + 3, 0);
  }
  context.stroke();
}

/** Scrubber of the selected run. */
class Timeline {
  constructor(player) {
    this.player = player;
    this.input = document.getElementById("scrubber");
    this.canvas = document.getElementById("ribbon");
    this.marks = document.getElementById("marks");
    this.clock = document.getElementById("clock");
    this.axis = new TimeAxis([0, 1], null, 0, 1);
    this.input.addEventListener("input", () => player.seek(this.axis.time(Number(this.input.value))));
    new ResizeObserver(() => this.paint()).observe(this.canvas);
  }

  setRun(run, theme) {
    this.run = run;
    this.theme = theme;
    this.grown();
  }

  /** Update after rows were appended or the run was replaced. */
  grown() {
    const { start, end, rest } = this.player;
    this.axis = new TimeAxis([start, Math.max(end, start + 1e-9)], rest, 0, 1); // positions from 0 to 1
    this._marks();
    this.paint();
    this.point();
  }

  /** Move the cursor. */
  point() {
    const { t, end, playing, live } = this.player;
    const part = Math.min(1, Math.max(0, this.axis.x(t))); // the axis of a live run is a little behind its cursor
    this.input.value = part;
    setText(this.clock, `${clock(t)} / ${clock(end, 1)}`);
    // screen readers announce it only when the cursor rests
    if (!playing && !live) this.input.setAttribute("aria-valuetext", this.run ? `${clock(t)}, ${activeWords(this.run, t).name} active` : clock(t));
    this.input.parentElement.style.setProperty("--part", part.toFixed(5));
  }

  /** Paint the ribbon: the color of the active region in full height, violations as notches below. */
  paint() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    const dots = window.devicePixelRatio || 1;
    this.canvas.width = Math.round(width * dots);
    this.canvas.height = Math.round(height * dots);
    const context = this.canvas.getContext("2d");
    context.scale(dots, dots);
    const x = (t) => this.axis.x(t) * width;
    context.fillStyle = pageColours().grid;
    context.fillRect(0, 0, width, height);
    const active = this.run?.column("active");
    if (!active || this.run.rows < 2) return;
    const { time, rows, header } = this.run;
    let from = 0;
    for (let i = 1; i <= rows; i++) {
      if (i < rows && active[i] === active[from]) continue;
      const region = header.regions[active[from]];
      if (region) {
        context.fillStyle = region.colour;
        context.globalAlpha = region.criterion ? 1 : 0.45;
        const left = x(time[from]);
        context.fillRect(left, 0, Math.max(1, x(time[Math.min(i, rows - 1)]) - left), height);
      }
      from = i;
    }
    context.globalAlpha = 1;
    context.fillStyle = pageColours().ink;
    for (const region of header.regions.filter((one) => one.criterion)) {
      for (const [first, last] of below(this.run, `${region.name}.clearance`)) {
        context.fillRect(x(first), height - 4, Math.max(2, x(last) - x(first)), 4);
      }
    }
    if (this.axis.broken) paintGap(context, x(this.axis.rest), height);
  }

  _marks() {
    const marks = this.run ? marksOf(this.run) : [];
    const key = JSON.stringify([this.axis.time(0), this.axis.time(1), marks]);
    if (key === this._key) return;
    this._key = key;
    this.marks.replaceChildren(
      ...marks.slice(0, 200).map(({ time, kind, text }) => {
        const mark = element("span", `mark-at ${kind}`);
        mark.style.left = `${100 * this.axis.x(time)}%`;
        mark.title = `${clock(time)}: ${text}`;
        mark.addEventListener("click", () => this.player.seek(time)); // keyboard users have keys and the list of events
        return mark;
      }),
    );
  }
}
