// Keyboard: one table for the key handler and for the help.

/** Return the keys of the page: label, text and actions of each; `whatIf` where the page can simulate. */
function keysOf(page, whatIf = null) {
  const { player, stage, board } = page;
  const turn = (dx, dy) => () => stage.camera("orbit", dx, dy);
  const move = (dx, dy) => () => stage.camera("pan", dx, dy);
  const look = (name) => () => stage.camera("look", name);
  return [
    { group: "Time", keys: "Space", text: "Play or pause", does: { " ": () => player.toggle() } },
    {
      group: "Time", keys: "← →", text: "One row back, one row on",
      does: { ArrowLeft: () => player.stepRows(-1, page.run), ArrowRight: () => player.stepRows(1, page.run) },
    },
    {
      group: "Time", keys: "Shift ← →", text: "One second back, one second on",
      does: { "Shift+ArrowLeft": () => player.seek(player.t - 1), "Shift+ArrowRight": () => player.seek(player.t + 1) },
    },
    {
      group: "Time", keys: "Home End", text: "To the start, to the end (of a live run: stay with it)",
      does: { Home: () => player.seek(player.start), End: () => player.seek(player.end) },
    },
    { group: "Time", keys: ", .", text: "To the event before, to the next event", does: { ",": () => page.event(-1), ".": () => page.event(1) } },
    { group: "Time", keys: "[ ]", text: "Slower, faster", does: { "[": () => player.shiftSpeed(-1), "]": () => player.shiftSpeed(1) } },
    {
      group: "Scene", keys: "Alt ← → ↑ ↓", text: "Turn round the scene",
      does: { "Alt+ArrowLeft": turn(-24, 0), "Alt+ArrowRight": turn(24, 0), "Alt+ArrowUp": turn(0, -24), "Alt+ArrowDown": turn(0, 24) },
    },
    {
      group: "Scene", keys: "Alt Shift ← → ↑ ↓", text: "Move the scene",
      does: {
        "Alt+Shift+ArrowLeft": move(-40, 0), "Alt+Shift+ArrowRight": move(40, 0),
        "Alt+Shift+ArrowUp": move(0, -40), "Alt+Shift+ArrowDown": move(0, 40),
      },
    },
    {
      group: "Scene", keys: "+ −", text: "Nearer, farther",
      does: { "+": () => stage.camera("zoom", 1.2), "=": () => stage.camera("zoom", 1.2), "-": () => stage.camera("zoom", 1 / 1.2) },
    },
    {
      group: "Scene", keys: "1 2 3 4", text: "Look aslant, from above, from the side, towards north",
      does: { 1: look("iso"), 2: look("top"), 3: look("side"), 4: look("front") },
    },
    { group: "Scene", keys: "0", text: "Everything into the picture", does: { 0: () => stage.camera("fit") } },
    { group: "Scene", keys: "F", text: "Follow the vehicle, or not", does: { f: () => player.setFollow(!player.follow) } },
    { group: "Scene", keys: "L", text: "Names of the regions, or none", does: { l: () => page.setLabels(!stage.labels) } },
    { group: "Charts", keys: "Z, Shift Z", text: "Shorter, longer window of time", does: { z: () => board.zoom(0.5), "Shift+z": () => board.zoom(2) } },
    { group: "Charts", keys: "X", text: "The whole run", does: { x: () => board.whole() } },
    ...(whatIf
      ? [
          { group: "What if", keys: "R", text: "Reset: the run as it was recorded", does: { r: () => whatIf.reset() } },
          { group: "What if", keys: "S", text: "Save as a scenario", does: { s: () => saveScenario(whatIf) } },
        ]
      : [{ group: "Page", keys: "R", text: "The next run into the panel", does: { r: () => page.select((page.selected + 1) % Math.max(1, page.runs.length)) } }]),
    { group: "Page", keys: "V", text: "Several runs side by side, or in one scene", does: { v: () => page.setSide(!stage.side) } },
    { group: "Page", keys: "T", text: "Light or dark", does: { t: () => page.setTheme(page.theme === "dark" ? "light" : "dark") } },
    { group: "Page", keys: "Esc", text: "Close the menu that is open", does: { Escape: closeMenu } },
    { group: "Page", keys: "?", text: "This help; Esc closes it", does: { "?": () => page.help() } },
  ];
}

/** Close the chart menu and open details around the focus; move the focus to their summary. */
function closeMenu() {
  for (const menu of document.querySelectorAll("#charts-menu[open], details[open]:focus-within")) {
    if (menu.contains(document.activeElement)) menu.querySelector("summary").focus();
    menu.open = false;
  }
}

/** Return the name of a key with its modifiers, as in the table. */
function keyName(event) {
  const letter = event.key.length === 1;
  const key = letter ? event.key.toLowerCase() : event.key;
  // a character that Shift changes has its own name
  const shift = event.shiftKey && (!letter || key !== key.toUpperCase());
  return `${event.altKey ? "Alt+" : ""}${shift ? "Shift+" : ""}${key}`;
}

/** Return true if an element handles a key itself. */
function wants(target, name) {
  const tag = target.tagName;
  if (name === "Escape") return false;
  if (tag === "SELECT" || tag === "TEXTAREA" || (tag === "INPUT" && !["range", "checkbox"].includes(target.type))) return true;
  return name === " " && (["BUTTON", "SUMMARY"].includes(tag) || target.type === "checkbox");
}

/** Listen to the keyboard of the document. */
function listenToKeys(page) {
  document.addEventListener("keydown", (event) => {
    const does = Object.assign({}, ...page.keys.map((key) => key.does));
    if (event.ctrlKey || event.metaKey || event.defaultPrevented) return;
    const name = keyName(event);
    if (!(name in does) || wants(event.target, name) || document.querySelector("dialog[open]")) return;
    event.preventDefault();
    does[name]();
  });
}

/** Fill the help dialog with the table of keys and hints for reading the page. */
function fillHelp(dialog, keys) {
  const close = pressable("close", "Close", "", () => dialog.close());
  const title = element("h2", "", "How to read and drive this page");
  title.id = "help-title";
  const hints = [
    "The one cursor is shared: the scene, the charts, the panel and the scrubber show the same moment.",
    "A region is drawn in full colour while the arbiter gives way to it. Vermilion and its shades: obstacles, orange: shapes, blue: depth, green: goal. The ribbon of the scrubber has the same colours; black notches below it are violations, signs above it are events: a triangle the goal, a cross a violation or a failure, an arrow a limit that cuts the force, a line a change of who is active, a diamond a command.",
    "Of goals in turn, the present one and the next, dotted, are drawn. The arrow beside the compass is the current at the vehicle.",
    "In the charts distances are positive where a region is respected and negative where it is violated; of the goal, negative is the way still to go.",
    "Scene: drag turns, right button or Shift and drag moves, the wheel comes nearer, double click fits. Two fingers pinch and move.",
    "Charts: click or drag seeks, Shift and drag picks a window of time, Ctrl and wheel zooms, double click shows the whole run. A click on a name puts its curve in or out.",
  ];
  const head = element("div", "help-head");
  head.append(title, close);
  const reading = listOf(hints.map((hint) => element("li", "", hint)));
  const groups = [...new Set(keys.map((key) => key.group))].map((group) => {
    const section = element("section");
    const list = element("dl");
    for (const { keys: label, text } of keys.filter((key) => key.group === group)) {
      const name = element("dt");
      for (const part of label.split(" ")) name.append(element("kbd", "", part.length > 1 ? part.replace(",", "") : part), " ");
      list.append(name, element("dd", "", text));
    }
    section.append(element("h3", "", group), list);
    return section;
  });
  const table = element("div", "help-keys");
  table.append(...groups);
  dialog.replaceChildren(head, reading, table);
}
