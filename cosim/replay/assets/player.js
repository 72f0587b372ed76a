// The clock of the page: where the one cursor is that scene, charts, panel and scrubber share.

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 20];

/** Moves a cursor through the time of some runs, from the first start to the last end [s]. */
class Player {
  constructor() {
    this.runs = [];
    this.t = 0;
    this.playing = false;
    this.speed = 1;
    this.follow = false;
    this.growing = false; // whether rows still come
    this._live = false;
    this._listeners = [];
    this._last = 0;
  }

  /** Take other runs; the cursor goes to their start. */
  setRuns(runs) {
    this.runs = runs;
    this.playing = false;
    this.t = this.start;
    this._tell();
  }

  /** Take other runs of the same time; the cursor stays. */
  replaceRuns(runs) {
    this.runs = runs;
    this.t = Math.min(this.t, this.end);
    this._tell();
  }

  get start() {
    const filled = this.runs.filter((run) => run.rows);
    return filled.length ? Math.min(...filled.map((run) => run.start)) : 0;
  }

  /** Of the longest run. */
  get end() {
    const filled = this.runs.filter((run) => run.rows);
    return filled.length ? Math.max(...filled.map((run) => run.end)) : 0;
  }

  /** From when on nothing moves in any run [s]; null while rows still come. */
  get rest() {
    return this.growing || !this.runs.length ? null : Math.max(...this.runs.map((run) => run.rest));
  }

  get duration() {
    return this.end - this.start;
  }

  /** Whether the cursor sticks to the end while rows come. */
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
    this._tell();
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
    this._tell();
  }

  pause() {
    this.playing = false;
    this._live = false;
    this._tell();
  }

  toggle() {
    if (this.playing || this.live) this.pause();
    else this.play();
  }

  /** Put the cursor at a time [s]; a live page lets go of the end. */
  seek(t) {
    if (!Number.isFinite(t)) return;
    this.t = Math.min(this.end, Math.max(this.start, t));
    this._live = this.growing && this.t >= this.end;
    this._tell();
  }

  /** Go some rows of a run (default: the first one) on or back, and halt there. */
  stepRows(n, run = this.runs.find((any) => any.rows)) {
    if (!run) return;
    this.playing = false;
    const row = run.row(this.t);
    const between = n < 0 && run.time[row] < this.t ? 1 : 0; // back from between two rows is to the first of them
    this.seek(run.time[Math.min(run.rows - 1, Math.max(0, row + n + between))]);
  }

  setSpeed(x) {
    this.speed = Math.min(SPEEDS.at(-1), Math.max(SPEEDS[0], x));
    this._tell();
  }

  /** One speed up (1) or down (-1). */
  shiftSpeed(by) {
    const at = SPEEDS.findLastIndex((speed) => speed <= this.speed);
    this.setSpeed(SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, at + by))]);
  }

  setFollow(on) {
    this.follow = on;
    this._tell();
  }

  /** Rows were appended to the runs. */
  grown() {
    if (this.live) this.t = this.end;
    this._tell();
  }

  _advance(now) {
    if (!this.playing) return;
    // a tab that slept does not jump
    this.t = Math.min(this.end, this.t + Math.min(0.25, Math.max(0, now - this._last) / 1000) * this.speed);
    this._last = now;
    const over = this.t >= this.end;
    if (over) {
      this.playing = false;
      this._live = this.growing;
    }
    // first the picture of now is asked for, then the next step: the other way round every second frame has no picture
    this._tell();
    if (!over) requestAnimationFrame((next) => this._advance(next));
  }

  _tell() {
    for (const fn of this._listeners) fn(this);
  }
}
