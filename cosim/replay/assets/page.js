// The page: the shown runs, and the updates of all parts.

/** Page with player, stage, board, panel and timeline. startLive() gets this object. */
class Page {
  constructor() {
    this.runs = [];
    this.shown = [];
    this.selected = 0;
    this.dark = matchMedia("(prefers-color-scheme: dark)");
    this.theme = this.dark.matches ? "dark" : "light";
    document.documentElement.dataset.theme = this.theme;
    this.player = new Player();
    this.stage = new Stage(this.theme, () => this.later());
    this.board = new Board(this.player, this.theme);
    this.panel = new Panel(this.player, { select: (index) => this.select(index), show: (index, on) => this.showRun(index, on) });
    this.timeline = new Timeline(this.player);
    this.canvas = this.stage.canvas; // of the first scene; it is never replaced
    this._next = 0;
    this._slow = 0;
    this._listen();
  }

  /** Return the scene of the first canvas; null while no run can be drawn. */
  scene() {
    return this.stage.scene;
  }

  /** Return the selected run, which panel and scrubber show. */
  get run() {
    return this.runs[this.selected];
  }

  /** Replace the runs; with `same` (the same scenario), keep cursor, window of time and view. */
  async show(all, same = false) {
    const runs = all.filter(timed);
    if (runs.length < all.length) {
      const names = runNames(all).filter((_, i) => !timed(all[i]));
      this.say(`Left out, as the record has no times: ${names.join(", ")}.`, "error");
    }
    this.runs = runs;
    this.shown = runs.map(() => true);
    this.selected = 0;
    if (same) this.player.replaceRuns(runs);
    else this.player.setRuns(runs);
    this.stage.side &&= runs.length > 1;
    document.getElementById("side").hidden = runs.length < 2;
    this._laid(same);
    if (!same) this.board.window = null;
    this.board.setRuns(runs, this.shown, this.selected);
    this.paint();
  }

  /** Replace the runs by as many of the same scenario: also keep which are shown, and which is selected. */
  replace(runs) {
    this.runs = runs;
    this.player.replaceRuns(runs);
    this.stage.setRuns(runs, this.shown, true);
    this._select();
    this.board.setRuns(runs, this.shown, this.selected);
    this.later();
  }

  /** Update after rows were appended to the runs, or events to their headers. */
  refresh() {
    if (!this.stage.scene && this.runs.some(drawable)) this._laid();
    this.player.grown();
    this.board.grown();
    if (this._slow) return;
    this._slow = setTimeout(() => {
      this._slow = 0;
      this.timeline.grown();
      if ((this.run?.header.events?.length ?? 0) !== this.panel.events?.length) this._select();
    }, 400);
  }

  /** Show a line in the status bar; an empty text clears it. `kind`: "info", "good", "warning" or "error". */
  say(text, kind = "info") {
    const status = document.getElementById("status");
    status.className = kind;
    setText(status, text);
  }

  /** Show a text in place of the scene; an empty text hides it. */
  nothing(text) {
    const empty = document.getElementById("empty");
    empty.hidden = !text;
    setText(empty, text);
  }

  /** Select the run that panel and scrubber show. */
  select(index) {
    if (!this.runs[index]) return;
    this.selected = index;
    this._select();
    this.board.setRuns(this.runs, this.shown, index);
    this.later();
  }

  /** Show or hide a run. */
  showRun(index, on) {
    this.shown[index] = on;
    this._laid();
    this.board.setRuns(this.runs, this.shown, this.selected);
  }

  /** Show each run in a scene of its own, or all in one. */
  setSide(on) {
    if (this.runs.length < 2) return;
    this.stage.setSide(on);
    this._pressed("side", on);
  }

  setLabels(on) {
    this.stage.labels = on;
    this._pressed("labels", on);
    this.later();
  }

  setTheme(theme) {
    this.theme = theme;
    document.documentElement.dataset.theme = theme;
    this.stage.setTheme(theme);
    this.board.setTheme(theme);
    this.timeline.setRun(this.run, theme);
    this.panel.setRuns(this.runs, this.shown, this.selected);
  }

  help() {
    document.getElementById("help").showModal();
  }

  /** Move the cursor to the next event of the selected run (1) or to the previous one (-1). */
  event(by) {
    const times = this.run ? marksOf(this.run).map(({ time }) => time).sort((a, b) => a - b) : [];
    const { t } = this.player;
    const to = by > 0 ? times.find((time) => time > t + 1e-9) : times.findLast((time) => time < t - 1e-9);
    if (to !== undefined) this.player.seek(to);
  }

  /** Paint with the next frame of the screen. */
  later() {
    this._next ||= requestAnimationFrame(() => this.paint());
  }

  /** Paint now. */
  paint() {
    cancelAnimationFrame(this._next);
    this._next = 0;
    const { player } = this;
    this.stage.draw(player.t, player.follow);
    this.board.point();
    this.panel.update();
    this.timeline.point();
    this._buttons();
    clearTimeout(this._quiet);
    if (!player.playing && !player.live) this._quiet = setTimeout(() => this._announce(), 900);
  }

  /** Lay out the scenes; `same` as for show(). */
  _laid(same) {
    document.body.classList.toggle("bare", !this.runs.length);
    this.stage.setRuns(this.runs, this.shown, same);
    let reason = "There is nothing to draw: no run has a row with a pose.";
    if (this.stage.scene) reason = "";
    else if (this.runs.some((run, i) => drawable(run) && !this.shown[i])) reason = "Every run is hidden.";
    else if (this.runs.some((run) => !run.rows && !run.header.status)) reason = "Waiting for the first row of the run.";
    this.nothing(reason);
    this._select();
  }

  _select() {
    showHead(this.runs, this.selected);
    this.timeline.setRun(this.run, this.theme);
    this.panel.setRuns(this.runs, this.shown, this.selected);
  }

  _announce() {
    if (!this.run?.rows) return;
    const { t } = this.player;
    setText(document.getElementById("spoken"), `${clock(t)}. ${activeWords(this.run, t).sentence}`);
  }

  _pressed(id, on) {
    document.getElementById(id).setAttribute("aria-pressed", String(on));
  }

  _buttons() {
    const { player } = this;
    const play = document.getElementById("play");
    const runs = player.playing || player.live;
    if (play.getAttribute("aria-label") !== (runs ? "Pause" : "Play")) {
      play.setAttribute("aria-label", runs ? "Pause" : "Play");
      play.querySelector("use").setAttribute("href", runs ? "#i-pause" : "#i-play");
    }
    const speed = document.getElementById("speed");
    if (Number(speed.value) !== player.speed) speed.value = String(player.speed);
    this._pressed("follow", player.follow);
    this._pressed("live", player.live);
    document.getElementById("live").hidden = !player.growing;
  }

  _listen() {
    const { player } = this;
    const press = (id, fn) => document.getElementById(id).addEventListener("click", fn);
    player.onChange(() => this.later());
    press("play", () => player.toggle());
    press("to-start", () => player.seek(player.start));
    press("row-back", () => player.stepRows(-1, this.run));
    press("row-on", () => player.stepRows(1, this.run));
    press("follow", () => player.setFollow(!player.follow));
    press("labels", () => this.setLabels(!this.stage.labels));
    press("side", () => this.setSide(!this.stage.side));
    press("theme", () => this.setTheme(this.theme === "dark" ? "light" : "dark"));
    press("help-open", () => this.help());
    press("fit", () => this.stage.camera("fit"));
    press("live", () => {
      player.live = !player.live;
    });
    for (const button of document.querySelectorAll("[data-look]")) {
      button.addEventListener("click", () => this.stage.camera("look", button.dataset.look));
    }
    const speed = document.getElementById("speed");
    speed.append(...SPEEDS.map((x) => new Option(`${x}×`, String(x), x === 1, x === 1)));
    speed.addEventListener("change", () => player.setSpeed(Number(speed.value)));
    this.dark.addEventListener("change", () => this.setTheme(this.dark.matches ? "dark" : "light"));
    listenToSplitter();
    this._print();
    this.setKeys(keysOf(this));
    listenToKeys(this);
  }

  /** Set the keys of the page and show them in the help. */
  setKeys(keys) {
    this.keys = keys;
    fillHelp(document.getElementById("help"), keys);
  }

  /** Print in the light theme with all charts. */
  _print() {
    let before = null;
    addEventListener("beforeprint", () => {
      before = this.theme;
      this.setTheme("light");
      this.paint();
      this.board.paintAll(true);
    });
    addEventListener("afterprint", () => {
      if (before) this.setTheme(before);
      this.board.paintAll(false);
      this.later();
    });
  }
}
