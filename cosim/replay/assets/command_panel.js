// Panel with commands to a live run: buttons, and the positions of target and regions as number fields.

const MODE_NAMES = ["manual", "hold", "reach", "mission", "surface", "stabilize", "depth_hold"];
const SURE = 4000; // ms, within which Reset must be pressed again
const NEW_OBSTACLES = 1001; // first number of obstacles from this page, above the numbers that sensors use

/** Panel of buttons and number fields over the scene. */
class CommandPanel {
  /** @param {LiveLink} link */
  constructor(link) {
    this.link = link;
    this.holder = element("details", "commands");
    this.holder.id = "commands";
    this.holder.open = matchMedia("(min-width: 960px)").matches;
    this.holder.hidden = true;
    this.state = element("span", "note");
    const summary = element("summary", "", "Steer ");
    summary.append(this.state);
    this.body = element("div", "command-body");
    this.holder.append(summary, this.body);
    document.getElementById("stage").append(this.holder);
    link.page.stage.coveredBy(this.holder);
    this._rows = [];
  }

  /** Build the panel for a run of the link. */
  setRun(run) {
    this.run = run;
    this.holder.hidden = false;
    this._rows = [];
    this.body.replaceChildren();
    if (!run.header.commands) {
      this.holder.open = false; // it offers nothing, and would hide a part of the scene
      this.body.append(element("p", "", "Watching only. Start the run with --commands to steer it from here."));
    } else {
      this.body.append(this._buttons(), this._list(), this._adding());
    }
    this.update();
  }

  /** Show mode, arming, connection and current positions. */
  update() {
    const { run, link } = this;
    if (!run) return;
    const mode = run.rows && run.has("commands.mode") ? MODE_NAMES[run.held("commands.mode", run.end)] : null;
    const armed = run.has("commands.armed") ? run.held("commands.armed", run.end) > 0 : true;
    let state = "watching";
    if (link.over) state = "the run has ended";
    else if (run.header.commands) state = link.acceptsCommands ? `${armed ? "armed" : "disarmed"}, ${mode ?? "waiting"}` : "no connection";
    setText(this.state, state);
    this.body.inert = Boolean(run.header.commands) && !link.acceptsCommands;
    for (const button of this.body.querySelectorAll("[data-mode]")) button.setAttribute("aria-pressed", String(button.dataset.mode === mode));
    for (const button of this.body.querySelectorAll("[data-armed]")) button.setAttribute("aria-pressed", String(button.dataset.armed === String(armed)));
    for (const row of this._rows) this._place(row);
  }

  _buttons() {
    const group = element("div", "command-buttons");
    group.setAttribute("role", "group");
    group.setAttribute("aria-label", "Commands");
    const add = (text, title, command, data = {}) => {
      const button = pressable("", text, title, () => this.link.command(command));
      Object.assign(button.dataset, data);
      group.append(button);
    };
    add("Arm", "Let the thrusters work", { command: "arm", armed: true }, { armed: "true" });
    add("Disarm", "Stop the thrusters", { command: "arm", armed: false }, { armed: "false" });
    add("Reach", "Go to the target region", { command: "set_mode", mode: "reach" }, { mode: "reach" });
    add("Hold", "Stay here", { command: "set_mode", mode: "hold" }, { mode: "hold" });
    add("Surface", "Come up", { command: "set_mode", mode: "surface" }, { mode: "surface" });
    group.append(this._reset());
    return group;
  }

  /** Return the reset button, which must be pressed twice. */
  _reset() {
    let sure = 0;
    const button = pressable("", "Reset", "End this run, and begin it again", () => {
      if (sure) this.link.command({ command: "reset" });
      clearTimeout(sure);
      setText(button, sure ? "Reset" : "Really reset?");
      sure = sure ? 0 : setTimeout(() => {
        sure = 0;
        setText(button, "Reset");
      }, SURE);
    });
    return button;
  }

  _list() {
    const list = element("div", "command-list");
    list.append(element("p", "hint", "Drag target and regions in the scene (Shift: up and down), or give numbers in metres: north, east, down."));
    this.run.header.regions.forEach((region, index) => {
      if (canMove(this.run, index)) list.append(this._row(region, index));
    });
    return list;
  }

  _row(region, index) {
    const set = element("fieldset");
    const name = index === 0 ? "target" : region.name;
    const legend = element("legend", "", name);
    set.append(legend);
    const fields = ["N", "E", "D"].map((letter, axis) => {
      const [label, field] = numberField(letter, `${name}, ${["north", "east", "down"][axis]} in metres`, 0.1);
      field.disabled = axis < 2 && isFlat(this.run, index);
      field.addEventListener("change", () => this._moved(row));
      set.append(label);
      return field;
    });
    const row = { index, set, fields };
    if (region.comes) set.append(pressable("gone", "Remove", "", () => this._forget(index)));
    this._rows.push(row);
    return set;
  }

  /** Write the position of a region into its fields, unless one of them has the focus. */
  _place({ index, set, fields }) {
    const place = placeOf(this.run, index, this.run.end);
    set.hidden = !place;
    if (!place || set.contains(document.activeElement)) return;
    fields.forEach((field, axis) => {
      const text = field.disabled ? "" : shortNumber(Number(place[axis].toFixed(2)));
      if (field.value !== text) field.value = text;
    });
  }

  _moved({ index, fields }) {
    const { run } = this;
    const from = placeOf(run, index, run.end);
    if (!from) return;
    const to = fields.map((field, axis) => {
      const written = field.valueAsNumber;
      // a field that shows the rounded position keeps the exact one
      return !Number.isFinite(written) || Math.abs(written - from[axis]) <= 0.005 ? from[axis] : written;
    });
    if (Vec.norm(Vec.sub(to, from)) > 0) this.link.move(index, from, to);
  }

  /** Return the button that adds a spherical obstacle ahead of the vehicle. */
  _adding() {
    return pressable("", "New obstacle", "A sphere to keep out of, ahead of the vehicle", () => {
      const { run } = this;
      if (!run.rows) return;
      const { position, quaternion } = run.pose(run.end);
      const radius = Number(Math.max(0.3, run.header.vehicle.radius).toFixed(2));
      const ahead = Vec.turned(Vec.matrix(quaternion), [1, 0, 0]);
      const way = Vec.unit([ahead[0], ahead[1], 0]);
      const place = Vec.along(position, way, 4 * radius + run.header.vehicle.radius);
      const known = run.header.changes.map((change) => change.number ?? 0);
      this.link.command({ command: "add_obstacle", number: Math.max(NEW_OBSTACLES - 1, ...known) + 1, position: place, radius });
    });
  }

  _forget(index) {
    const came = this.run.header.changes.findLast((change) => change.region === index && change.number !== undefined);
    if (came) this.link.command({ command: "remove_obstacle", number: came.number });
  }
}
