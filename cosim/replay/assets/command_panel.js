// Panel with commands to a live run: buttons, and the positions of target and regions as number fields.

const MODE_NAMES = ["manual", "hold", "reach", "mission", "surface", "stabilize", "depth_hold"];
const SURE = 4000; // ms, within which Reset must be pressed again
const NEW_OBSTACLES = 1001; // first number of obstacles from this page, above the numbers that sensors use
const HINT = "Drag target and regions in the scene (Shift: up and down), or give numbers in meters: north, east, down.";

/** Panel of buttons and number fields over the scene. */
class CommandPanel extends FieldPanel {
  /** @param {LiveLink} link */
  constructor(link) {
    super(link.page, "Steer");
    this.link = link;
    this.holder.hidden = true;
    this._rows = [];
  }

  /** Build the panel for a run of the link. */
  setRun(run) {
    this.run = run;
    this.holder.hidden = false;
    this._rows = [];
    if (!run.header.commands) {
      this.holder.open = false; // it offers nothing, and would hide a part of the scene
      this.body.replaceChildren(h("p", {}, "Watching only. Start the run with --commands to steer it from here."));
      return this.update();
    }
    if (Array.isArray(run.header.commands)) { // modes alone: a companion holds and resumes
      this.body.replaceChildren(this._buttons());
      return this.update();
    }
    this._rows = [...run.header.regions.keys()].filter((index) => canMove(run, index)).map((index) => this._row(index));
    const props = { title: "A sphere to keep out of, ahead of the vehicle", onclick: () => this._addObstacle() };
    const list = h("div.command-list", {}, h("p.hint", {}, HINT), ...this._rows.map(({ set }) => set));
    this.body.replaceChildren(this._buttons(), list, h("button", props, "New obstacle"));
    return this.update();
  }

  /** Show mode, arming, connection and current positions. */
  update() {
    const { run, link } = this;
    if (!run) return;
    const armed = run.held("commands.armed", run.end) !== 0;
    const commands = Boolean(run.header.commands);
    const modesAlone = Array.isArray(run.header.commands);
    const mode = modesAlone ? (armed ? "reach" : "hold") : MODE_NAMES[run.held("commands.mode", run.end)];
    const status = modesAlone ? mode : `${armed ? "armed" : "disarmed"}, ${mode ?? "waiting"}`;
    const steers = link.acceptsCommands ? status : "no connection";
    setText(this.state, link.over ? "the run has ended" : commands ? steers : "watching");
    this.body.inert = commands && !link.acceptsCommands;
    for (const button of this.body.querySelectorAll("[data-mode], [data-armed]")) {
      button.ariaPressed = [mode, String(armed)].includes(button.dataset.mode ?? button.dataset.armed);
    }
    for (const row of this._rows) this._place(row);
  }

  _buttons() {
    const group = byId("steer").content.firstElementChild.cloneNode(true);
    const { commands } = this.run.header;
    if (Array.isArray(commands)) for (const button of group.children) button.hidden = !commands.includes(button.dataset.mode);
    for (const button of group.querySelectorAll("[data-mode], [data-armed]")) {
      const { mode, armed } = button.dataset;
      const command = mode ? { command: "set_mode", mode } : { command: "arm", armed: armed === "true" };
      button.onclick = () => this.link.command(command);
    }
    const reset = group.querySelector(".reset"); // must be pressed twice
    let timer = 0;
    const cancelReset = () => {
      clearTimeout(timer);
      timer = 0;
      setText(reset, "Reset");
    };
    reset.onclick = () => {
      if (timer) {
        this.link.command({ command: "reset" });
        cancelReset();
      } else {
        setText(reset, "Really reset?");
        timer = setTimeout(cancelReset, SURE);
      }
    };
    return group;
  }

  _row(index) {
    const { is_dynamic: isDynamic, name: regionName } = this.run.header.regions[index];
    const name = index === 0 ? "target" : regionName;
    const fields = DIRECTIONS.map(([letter, direction], axis) => {
      const props = { disabled: axis < 2 && isFlat(this.run, index), onchange: () => this._moved(row) };
      return numberField(letter, `${name}, ${direction} in meters`, 0.1, props);
    });
    const set = fieldSet(name, ...fields.map(([label]) => label));
    if (isDynamic) set.append(h("button.gone", { onclick: () => this._forget(index) }, "Remove"));
    const row = { index, set, fields: fields.map(([, field]) => field) };
    return row;
  }

  /** Write the position of a region into its fields, unless one of them has the focus. */
  _place({ index, set, fields }) {
    const position = placeOf(this.run, index, this.run.end);
    set.hidden = !position;
    if (!position || set.contains(document.activeElement)) return;
    fields.forEach((field, axis) => {
      field.value = field.disabled ? "" : shortNumber(Number(position[axis].toFixed(2)));
    });
  }

  _moved({ index, fields }) {
    const { run } = this;
    const from = placeOf(run, index, run.end);
    if (!from) return;
    // a field that shows the rounded position keeps the exact one
    const to = fields.map(({ valueAsNumber: x }, axis) => (Math.abs(x - from[axis]) > 0.005 ? x : from[axis]));
    if (Vec.distance(to, from) > 0) this.link.move(index, from, to);
  }

  /** Add a spherical obstacle ahead of the vehicle. */
  _addObstacle() {
    const { run } = this;
    if (!run.rows) return;
    const { position, quaternion } = run.pose(run.end);
    const { vehicle, changes } = run.header;
    const radius = Number(Math.max(0.3, vehicle.radius).toFixed(2));
    const [north, east] = Vec.turned(Vec.matrix(quaternion), [1, 0, 0]);
    const obstacle = Vec.along(position, Vec.unit([north, east, 0]), 4 * radius + vehicle.radius);
    const number = Math.max(NEW_OBSTACLES - 1, ...changes.map((change) => change.number ?? 0)) + 1;
    this.link.command({ command: "add_obstacle", number, position: obstacle, radius });
  }

  _forget(index) {
    const addition = this.run.header.changes.findLast((change) => change.region === index && change.number !== undefined);
    if (addition) this.link.command({ command: "remove_obstacle", number: addition.number });
  }
}
