// Playback clock: the one cursor of scene, charts, panel and scrubber.

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 20];

/** Cursor through the time of some runs, from the first start to the last end [s]. */
class Player {
  /** @param {function} onChange called after every change */
  constructor(onChange) {
    this.runs = [];
    this.t = 0;
    this.playing = false;
    this.speed = 1;
    this.follow = false;
    this.growing = false; // true while rows arrive
    this._live = false;
    this._notify = onChange;
  }

  /** Replace the runs; the cursor moves to their start, or stays with `same`, for runs of the same time. */
  setRuns(runs, same = false) {
    this.runs = runs;
    this.playing &&= same;
    this.t = same ? Math.min(this.t, this.end) : this.start;
    this._notify();
  }

  get start() { return this._filled.length ? Math.min(...this._filled.map((run) => run.start)) : 0; }

  /** Return the last time of the run that ends last [s]. */
  get end() { return this._filled.length ? Math.max(...this._filled.map((run) => run.end)) : 0; }

  /** Return the time after which nothing moves in any run [s]; null while rows arrive. */
  get rest() { return this.growing || !this.runs.length ? null : Math.max(...this.runs.map((run) => run.rest)); }

  get duration() { return this.end - this.start; }

  /** Return true if the cursor stays at the end while rows arrive. */
  get live() { return this._live; }

  set live(on) {
    this._live = on;
    if (on) Object.assign(this, { growing: true, playing: false, t: this.end });
    this._notify();
  }

  play() {
    if (this.playing || this.live || !this.runs.length) return;
    if (this.t >= this.end && this.growing) {
      this.live = true;
      return;
    }
    if (this.t >= this.end) this.t = this.start;
    this.playing = true;
    this._last = performance.now();
    requestAnimationFrame((now) => this._advance(now));
    this._notify();
  }

  pause() {
    this.playing = false;
    this.live = false;
  }

  toggle() {
    if (this.playing || this.live) this.pause();
    else this.play();
  }

  /** Move the cursor to a time [s]; before the end, a live page stops following it. */
  seek(t) {
    this.t = clamp(t, this.start, this.end);
    this._live = this.growing && this.t >= this.end;
    this._notify();
  }

  /** Move the cursor by some rows of a run (default: the first one with rows), and pause there. */
  stepRows(n, run = this._filled[0]) {
    if (!run) return;
    this.playing = false;
    const row = run.row(this.t);
    const between = n < 0 && run.time[row] < this.t ? 1 : 0; // back from between two rows: to the first
    this.seek(run.time[clamp(row + n + between, 0, run.rows - 1)]);
  }

  setSpeed(x) {
    this.speed = clamp(x, SPEEDS[0], SPEEDS.at(-1));
    this._notify();
  }

  /** Increase (1) or decrease (-1) the speed by one step. */
  shiftSpeed(by) {
    const index = SPEEDS.findLastIndex((speed) => speed <= this.speed);
    this.setSpeed(SPEEDS[clamp(index + by, 0, SPEEDS.length - 1)]);
  }

  setFollow(on) {
    this.follow = on;
    this._notify();
  }

  /** Notify of rows that were appended; a live cursor moves to the end. */
  grown() {
    if (this.live) this.t = this.end;
    this._notify();
  }

  get _filled() { return this.runs.filter((run) => run.rows); }

  _advance(now) {
    if (!this.playing) return;
    // limit the step, as a hidden tab has no frames
    this.t = Math.min(this.end, this.t + clamp((now - this._last) / 1000, 0, 0.25) * this.speed);
    this._last = now;
    this.playing = this.t < this.end;
    this._live = !this.playing && this.growing;
    // the listener requests its frame first: in the other order every second frame would have no picture
    this._notify();
    if (this.playing) requestAnimationFrame((next) => this._advance(next));
  }
}
