// Keyboard: one table for the key handler, for buttons that do the same (data-key), and for the help.

/** Return the keys of the page: group, keys as shown, text and actions; `whatIf` where the page can simulate. */
function keysOf(page, whatIf = null) {
  const { player, stage, board } = page;
  const camera = (...call) => () => stage.camera(...call);
  const [slower, faster] = [-1, 1].map((by) => () => player.shiftSpeed(by));
  const [back, on] = [-1, 1].map((by) => () => player.stepRows(by, page.run));
  const [secondBack, secondOn] = [-1, 1].map((by) => () => player.seek(player.t + by));
  const [eventBack, eventOn] = [-1, 1].map((by) => () => page.event(by));
  const nextRun = () => page.select((page.selected + 1) % Math.max(1, page.runs.length));
  return [
    ["Time", "Space", "Play or pause", { " ": () => player.toggle() }],
    ["Time", "← →", "One row back, one row on", { ArrowLeft: back, ArrowRight: on }],
    ["Time", "Shift ← →", "One second back, one second on", {
      "Shift+ArrowLeft": secondBack, "Shift+ArrowRight": secondOn,
    }],
    ["Time", "Home End", "To the start, to the end (of a live run: stay with it)", {
      Home: () => player.seek(player.start), End: () => player.seek(player.end),
    }],
    ["Time", ", .", "To the event before, to the next event", { ",": eventBack, ".": eventOn }],
    ["Time", "[ ]", "Slower, faster", { "[": slower, "]": faster }],
    ["Scene", "Alt ← → ↑ ↓", "Turn round the scene", {
      "Alt+ArrowLeft": camera("orbit", -24, 0), "Alt+ArrowRight": camera("orbit", 24, 0),
      "Alt+ArrowUp": camera("orbit", 0, -24), "Alt+ArrowDown": camera("orbit", 0, 24),
    }],
    ["Scene", "Alt Shift ← → ↑ ↓", "Move the scene", {
      "Alt+Shift+ArrowLeft": camera("pan", -40, 0), "Alt+Shift+ArrowRight": camera("pan", 40, 0),
      "Alt+Shift+ArrowUp": camera("pan", 0, -40), "Alt+Shift+ArrowDown": camera("pan", 0, 40),
    }],
    ["Scene", "+ −", "Nearer, farther", {
      "+": camera("zoom", 1.2), "=": camera("zoom", 1.2), "-": camera("zoom", 1 / 1.2),
    }],
    ["Scene", "1 2 3 4", "Look aslant, from above, from the side, towards north", {
      1: camera("look", "iso"), 2: camera("look", "top"), 3: camera("look", "side"), 4: camera("look", "front"),
    }],
    ["Scene", "0", "Everything into the picture", { 0: camera("fit") }],
    ["Scene", "F", "Follow the vehicle, or not", { f: () => player.setFollow(!player.follow) }],
    ["Scene", "L", "Names of the regions, or none", { l: () => page.setLabels(!stage.labels) }],
    ["Charts", "Z, Shift Z", "Shorter, longer window of time", {
      z: () => board.zoom(0.5), "Shift+z": () => board.zoom(2),
    }],
    ["Charts", "X", "The whole run", { x: () => board.whole() }],
    ...(whatIf
      ? [
          ["What if", "R", "Reset: the run as it was recorded", { r: () => whatIf.reset() }],
          ["What if", "S", "Save as a scenario", { s: () => saveScenario(whatIf) }],
        ]
      : [["Page", "R", "The next run into the panel", { r: nextRun }]]),
    ["Page", "V", "Several runs side by side, or in one scene", { v: () => page.setSide(!stage.side) }],
    ["Page", "T", "Light or dark", { t: () => page.switchTheme() }],
    ["Page", "Esc", "Close the menu that is open", { Escape: closeMenu }],
    ["Page", "?", "This help; Esc closes it", { "?": () => page.help() }],
  ];
}

/** Close the chart menu and open details around the focus; move the focus to their summary. */
function closeMenu() {
  for (const menu of document.querySelectorAll("#charts-menu[open], details[open]:focus-within")) {
    if (menu.contains(document.activeElement)) menu.querySelector("summary").focus();
    menu.open = false;
  }
}

/** Return the action of a key, by its name. */
const actionOf = (keys, name) => keys.map(([, , , actions]) => actions[name]).find(Boolean);

/** Return the name of a key with its modifiers, as in the table. */
function keyName({ key, altKey, shiftKey }) {
  const name = key.length === 1 ? key.toLowerCase() : key;
  // a character that Shift changes has its own name
  const shift = shiftKey && (key.length > 1 || name !== name.toUpperCase());
  return `${altKey ? "Alt+" : ""}${shift ? "Shift+" : ""}${name}`;
}

/** Return true if an element handles a key itself. */
function wants(target, name) {
  if (name === "Escape") return false;
  if (target.matches("select, textarea, input:not([type=range], [type=checkbox])")) return true;
  return name === " " && target.matches("button, summary, [type=checkbox]");
}

/** Listen to the keyboard of the document. */
function listenToKeys(page) {
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.defaultPrevented) return;
    const name = keyName(event);
    const does = actionOf(page.keys, name);
    if (!does || wants(event.target, name) || document.querySelector("dialog[open]")) return;
    event.preventDefault();
    does();
  });
}

/** Write the table of keys into the help. */
function fillHelp(keys) {
  const groups = [...new Set(keys.map(([group]) => group))].map((group) => {
    const rows = keys.filter(([of]) => of === group).flatMap(([, label, text]) => {
      const caps = label.split(" ").map((cap) => (cap.length > 1 ? cap.replace(",", "") : cap));
      const parts = caps.flatMap((cap) => [h("kbd", {}, cap), " "]);
      return [h("dt", {}, ...parts), h("dd", {}, text)];
    });
    return h("section", {}, h("h3", {}, group), h("dl", {}, ...rows));
  });
  document.querySelector(".help-keys").replaceChildren(...groups);
}
