// Playback clock: the one cursor of scene, charts, panel and scrubber.

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 20];

/** Cursor through the time of some runs, from the first start to the last end [s]. */
class Player {
  constructor() {
    this.runs = [];
    this.t = 0;
    this.playing = false;
    this.speed = 1;
    this.follow = false;
    this.growing = false; // true while rows arrive
    this._live = false;
    this._listeners = [];
    this._last = 0;
  }

  /** Replace the runs and move the cursor to their start. */
  setRuns(runs) {
    this.runs = runs;
    this.playing = false;
    this.t = this.start;
    this._notify();
  }

  /** Replace the runs by others of the same time; the cursor stays. */
  replaceRuns(runs) {
    this.runs = runs;
    this.t = Math.min(this.t, this.end);
    this._notify();
  }

  get start() {
    const filled = this.runs.filter((run) => run.rows);
    return filled.length ? Math.min(...filled.map((run) => run.start)) : 0;
  }

  /** Return the last time of the run that ends last [s]. */
  get end() {
    const filled = this.runs.filter((run) => run.rows);
    return filled.length ? Math.max(...filled.map((run) => run.end)) : 0;
  }

  /** Return the time after which nothing moves in any run [s]; null while rows arrive. */
  get rest() {
    return this.growing || !this.runs.length ? null : Math.max(...this.runs.map((run) => run.rest));
  }

  get duration() {
    return this.end - this.start;
  }

  /** Return true if the cursor stays at the end while rows arrive. */
  get live() {
    return this._live;
  }

  set live(on) {
    this._live = on;
    if (on) {
      this.growing = true;
      this.playing = false;
      this.t = this.end;
    }
    this._notify();
  }

  /** Call `fn(player)` after every change. */
  onChange(fn) {
    this._listeners.push(fn);
  }

  play() {
    if (this.playing || this.live || !this.runs.length) return;
    if (this.t >= this.end) {
      if (this.growing) {
        this.live = true;
        return;
      }
      this.t = this.start;
    }
    this.playing = true;
    this._last = performance.now();
    requestAnimationFrame((now) => this._advance(now));
    this._notify();
  }

  pause() {
    this.playing = false;
    this._live = false;
    this._notify();
  }

  toggle() {
    if (this.playing || this.live) this.pause();
    else this.play();
  }

  /** Move the cursor to a time [s]; before the end, a live page stops following it. */
  seek(t) {
    if (!Number.isFinite(t)) return;
    this.t = Math.min(this.end, Math.max(this.start, t));
    this._live = this.growing && this.t >= this.end;
    this._notify();
  }

  /** Move the cursor by some rows of a run (default: the first one with rows), and pause there. */
  stepRows(n, run = this.runs.find((any) => any.rows)) {
    if (!run) return;
    this.playing = false;
    const row = run.row(this.t);
    const between = n < 0 && run.time[row] < this.t ? 1 : 0; // back from between two rows: to the first
    this.seek(run.time[Math.min(run.rows - 1, Math.max(0, row + n + between))]);
  }

  setSpeed(x) {
    this.speed = Math.min(SPEEDS.at(-1), Math.max(SPEEDS[0], x));
    this._notify();
  }

  /** Increase (1) or decrease (-1) the speed by one step. */
  shiftSpeed(by) {
    const at = SPEEDS.findLastIndex((speed) => speed <= this.speed);
    this.setSpeed(SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, at + by))]);
  }

  setFollow(on) {
    this.follow = on;
    this._notify();
  }

  /** Notify the listeners after rows were appended; a live cursor moves to the end. */
  grown() {
    if (this.live) this.t = this.end;
    this._notify();
  }

  _advance(now) {
    if (!this.playing) return;
    // limit the step, as a hidden tab has no frames
    this.t = Math.min(this.end, this.t + Math.min(0.25, Math.max(0, now - this._last) / 1000) * this.speed);
    this._last = now;
    const over = this.t >= this.end;
    if (over) {
      this.playing = false;
      this._live = this.growing;
    }
    // listeners request their frame first: in the other order every second frame would have no picture
    this._notify();
    if (!over) requestAnimationFrame((next) => this._advance(next));
  }

  _notify() {
    for (const fn of this._listeners) fn(this);
  }
}
