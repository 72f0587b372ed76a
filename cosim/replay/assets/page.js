// The page: the shown runs, and the updates of all parts.

/** Page with player, stage, board, panel and timeline. startLive() gets this object. */
class Page {
  constructor() {
    this.runs = [];
    this.shown = [];
    this.selected = 0;
    this.dark = matchMedia("(prefers-color-scheme: dark)");
    this._setTheme(this.dark.matches ? "dark" : "light");
    this.player = new Player(() => this.later());
    this.stage = new Stage(() => this.later());
    this.board = new Board(this.player);
    this.panel = new Panel(this.player, {
      select: (index) => this.select(index),
      show: (index, on) => this.showRun(index, on),
    });
    this.timeline = new Timeline(this.player);
    this._next = 0;
    this._slow = 0;
    this._listen();
  }

  /** Return the scene of the first canvas; null while no run can be drawn. */
  scene() { return this.stage.scene; }

  /** Return the first canvas, which is never replaced. */
  get canvas() { return this.stage.canvas; }

  /** Return the selected run, which panel and scrubber show. */
  get run() { return this.runs[this.selected]; }

  /** Replace the runs; with `same` (the same scenario), keep cursor, window of time and view. */
  async show(all, same = false) {
    const runs = all.filter(timed);
    const left = runNames(all).filter((_, i) => !timed(all[i]));
    if (left.length) this.say(`Left out, as the record has no times: ${left.join(", ")}.`, "error");
    Object.assign(this, { runs, shown: runs.map(() => true), selected: 0 });
    this.player.setRuns(runs, same);
    this.stage.side &&= runs.length > 1;
    byId("side").hidden = runs.length < 2;
    this._layOut(same);
    if (!same) this.board.window = null;
    this._chart();
    this.paint();
  }

  /** Replace the runs by as many of the same scenario: also keep which are shown, and which is selected. */
  replace(runs) {
    this.runs = runs;
    this.player.setRuns(runs, true);
    this.stage.setRuns(runs, this.shown, true);
    this._select();
    this._chart();
  }

  /** Update after rows were appended to the runs, or events to their headers. */
  refresh() {
    if (!this.stage.scene && this.runs.some(drawable)) this._layOut();
    this.player.grown();
    this.board.grown();
    this._slow ||= setTimeout(() => {
      this._slow = 0;
      this.timeline.grown();
      if (this.run?.header.events?.length !== this._events) this._select();
    }, 400);
  }

  /** Show a line in the status bar; an empty text clears it. `kind`: "info", "good", "warning" or "error". */
  say(text, kind = "info") {
    byId("status").className = kind;
    setText(byId("status"), text);
  }

  /** Show a text in place of the scene; an empty text hides it. */
  nothing(text) {
    byId("empty").hidden = !text;
    setText(byId("empty"), text);
  }

  /** Select the run that panel and scrubber show. */
  select(index) {
    if (!this.runs[index]) return;
    this.selected = index;
    this._select();
    this._chart();
  }

  /** Show or hide a run. */
  showRun(index, on) {
    this.shown[index] = on;
    this._layOut();
    this._chart();
  }

  /** Show each run in a scene of its own, or all in one. */
  setSide(on) {
    if (this.runs.length < 2) return;
    this.stage.setSide(on);
    this.later();
  }

  setLabels(on) {
    this.stage.labels = on;
    this.later();
  }

  setTheme(theme) {
    this._setTheme(theme);
    this.stage.repaint();
    this.board.repaint();
    this._select();
  }

  switchTheme() { this.setTheme(this.theme === "dark" ? "light" : "dark"); }

  help() { byId("help").showModal(); }

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

  /** Set the keys of the page and show them in the help. */
  setKeys(keys) {
    this.keys = keys;
    fillHelp(keys);
  }

  _setTheme(theme) {
    this.theme = theme;
    document.documentElement.dataset.theme = theme;
    readColors();
  }

  /** Lay out the scenes; `same` as for show(). */
  _layOut(same) {
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
    this.timeline.setRun(this.run);
    this.panel.setRuns(this.runs, this.shown, this.selected);
    this._events = this.run?.header.events?.length;
    this.later();
  }

  _chart() { this.board.setRuns(this.runs, this.shown, this.selected); }

  _announce() {
    const { t } = this.player;
    if (this.run?.rows) setText(byId("spoken"), `${clock(t)}. ${activeWords(this.run, t).sentence}`);
  }

  _buttons() {
    const { player, stage } = this;
    const runs = player.playing || player.live;
    byId("play").ariaLabel = runs ? "Pause" : "Play";
    byId("play").querySelector("use").setAttribute("href", runs ? "#i-pause" : "#i-play");
    byId("speed").value = player.speed;
    byId("live").hidden = !player.growing;
    const pressed = { follow: player.follow, live: player.live, side: stage.side, labels: stage.labels };
    for (const [id, on] of Object.entries(pressed)) byId(id).ariaPressed = on;
  }

  _listen() {
    const { player } = this;
    for (const button of document.querySelectorAll("[data-key]")) {
      button.onclick = () => actionOf(this.keys, button.dataset.key)();
    }
    byId("live").onclick = () => {
      player.live = !player.live;
    };
    byId("speed").append(...SPEEDS.map((x) => new Option(`${x}×`, x)));
    byId("speed").onchange = ({ target }) => player.setSpeed(Number(target.value));
    this.dark.onchange = () => this.setTheme(this.dark.matches ? "dark" : "light");
    listenToSplitter();
    this._print();
    this.setKeys(keysOf(this));
    listenToKeys(this);
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
      this.setTheme(before);
      this.board.paintAll(false);
    });
  }
}
