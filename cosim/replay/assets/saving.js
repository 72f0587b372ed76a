// Export of the scenario with the reader's numbers, as a file for `cosim run`.

/** Format a number as a TOML float. */
const tomlNumber = (x) => (Number.isInteger(x) ? x.toFixed(1) : String(x));

/** Return the TOML text of the scenario with the current numbers. */
function scenarioText(whatIf) {
  const { toml, title } = whatIf.flight.data;
  const changed = whatIf.words();
  const more = changed.length > 3 ? ` and ${changed.length - 3} more` : "";
  const words = changed.length ? `${title} (what if: ${changed.slice(0, 3).join(", ")}${more})` : title;
  const filled = toml.keys.map((key) => (key === "title" ? JSON.stringify(words) : tomlNumber(whatIf.value(key))));
  const text = toml.parts.map((part, i) => part + (filled[i] ?? "")).join("");
  if (!whatIf.failure) return text;
  const { thruster, time } = whatIf.failure;
  return `${text}\n[[failures]]\nthruster = ${thruster}\ntime = ${tomlNumber(time)}\n`;
}

/** Download the scenario file. */
function saveScenario(whatIf) {
  const href = URL.createObjectURL(new Blob([scenarioText(whatIf)], { type: "application/toml" }));
  const download = `${whatIf.flight.data.name}-what-if.toml`;
  h("a", { href, download }).click();
  setTimeout(() => URL.revokeObjectURL(href), 60000);
  whatIf.page.say(`Saved as ${download}: “cosim run ${download}” flies it again.`, "good");
}
