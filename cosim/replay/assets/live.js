// Live run: rows arrive over a WebSocket from the page's own host, and commands return on it.

const RETRY = [500, 5000]; // ms, delay before a reconnection: at first, and at most

/** Connection of the page to a live run. */
class LiveLink {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    this.run = null;
    this.over = false; // true once the run has ended
    this.commandPanel = new CommandPanel(this);
    this.dragging = new Dragging(this);
    this._wait = RETRY[0];
    this._next = 0;
  }

  /** Return true if commands can be sent now. */
  get acceptsCommands() {
    return Boolean(this.run?.header.commands) && !this.over && this._socket?.readyState === WebSocket.OPEN;
  }

  /** Return the time at which regions are dragged [s]: the end of the run. */
  get time() { return this.run.end; }

  /** Return the reason why nothing can be dragged now; "" if regions can be dragged. */
  get refusal() {
    return this.page.player.live ? "" : "What is in the past cannot be moved: go to the end (End) to drag regions.";
  }

  canMove(region) { return canMove(this.run, region); }

  /** Send the command that moves a region from one point to another [m, NED]. */
  move(region, from, to) { this.command(commandToMove(this.run, region, from, to, this.run.end)); }

  /** Connect; the promise resolves at the first message or when the connection closes. */
  connect() {
    return new Promise((settled) => {
      const socket = new WebSocket(`${location.protocol.replace("http", "ws")}//${location.host}/ws`);
      this._socket = socket;
      socket.binaryType = "arraybuffer";
      socket.onopen = () => {
        this._wait = RETRY[0];
      };
      socket.onmessage = ({ data }) => {
        if (typeof data === "string") this._receive(JSON.parse(data));
        else this._rows(new Float64Array(data));
        this._later();
        settled();
      };
      socket.onclose = () => {
        settled();
        this._lost();
      };
    });
  }

  /** Send a command, in the format of the run's log of commands. */
  command(command) {
    const reason = this.over
      ? "The run has ended: nothing can be commanded any more."
      : "Nothing can be commanded: the connection is lost, or commands are off.";
    if (this.acceptsCommands) this._socket.send(JSON.stringify(command));
    else this.page.say(reason, "warning");
  }

  _receive(message) {
    const does = {
      header: () => this._begin(message.run),
      changes: () => this.run.header.changes.push(...message.changes),
      message: () => this._showMessage(message),
      end: () => this._end(message),
    };
    does[message.type]?.();
  }

  _begin(header) {
    const again = this.run !== null;
    header.events ??= [];
    this.run = new Run(header, header.signals.map(() => new Float64Array(0)));
    this.over = false;
    document.title = `Live: ${header.title}`;
    this.page.show([this.run]);
    this.page.player.live = true;
    this.page.say(again ? "The run begins again." : "");
    this.commandPanel.setRun(this.run);
  }

  _rows(numbers) {
    const width = this.run.header.signals.length;
    for (let i = 0; i < numbers.length; i += width) this.run.append(numbers.subarray(i, i + width));
  }

  _showMessage({ kind, text, time }) {
    if (kind === "command") this.run.header.events.push({ time, kind, text: `Commanded: ${text}` });
    else this.page.say(kind === "refused" ? `Refused: ${text}` : text, kind === "info" ? "info" : "warning");
  }

  _end({ status, verdict }) {
    Object.assign(this.run.header, { status, verdict });
    this.over = true;
    this.page.refresh();
    this.page.player.pause();
    this.page.player.growing = false;
    this.page.select(0); // shows the verdict
    this.page.say(`The run has ended (${status}). This page replays what it has received.`, "good");
  }

  _lost() {
    this.dragging.cancel();
    this.commandPanel.update();
    if (this.over) return;
    this.page.say(`${this.run ? "The connection is lost" : "No run answers here"}; trying again …`, "warning");
    if (!this.run) this.page.nothing("Waiting for a run.");
    setTimeout(() => this.connect(), this._wait);
    this._wait = Math.min(RETRY[1], 2 * this._wait);
  }

  /** Update page and panel once with the next frame. */
  _later() {
    this._next ||= requestAnimationFrame(() => {
      this._next = 0;
      this.page.refresh();
      this.commandPanel.update();
    });
  }
}

/** Show the live run of the page's own host. */
async function startLive(page) {
  page.nothing("Waiting for a run.");
  await new LiveLink(page).connect();
}
