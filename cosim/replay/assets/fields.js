// Fields over the scene: of commands to a live run, or of the numbers of a run that is simulated again.

const DIRECTIONS = [["N", "north"], ["E", "east"], ["D", "down"]];

/** Panel over the scene that opens and closes: `state` is a text beside its title, `body` gets the fields. */
class FieldPanel {
  constructor(page, title) {
    this.state = h("span.note");
    this.body = h("div.command-body");
    const open = matchMedia("(min-width: 960px)").matches;
    const summary = h("summary", {}, `${title} `, this.state);
    this.holder = h("details.commands", { id: "commands", open }, summary, this.body);
    byId("stage").append(this.holder);
    page.stage.coveredBy(this.holder);
  }
}

/** Return a set of fields with a title. */
const fieldSet = (title, ...fields) => h("fieldset", {}, h("legend", {}, title), ...fields);

/** Return a number field, and its label, for screen readers `ariaLabel`: [label, field]. */
function numberField(text, ariaLabel, step, props = {}) {
  const field = h("input", { type: "number", step, ariaLabel, ...props });
  return [h("label", {}, text, field), field];
}
