// Head of the page: task, verdict and warnings of the runs; and the splitter between scene and charts.

/** Write the head of the selected run, and the warnings of all runs. */
function showHead(runs, selected) {
  const title = document.getElementById("title");
  const run = runs[selected];
  const names = runNames(runs);
  const name = runs.length > 1 ? `${names[selected]}: ` : "";
  title.textContent = run ? name + (run.header.title || names[selected]) : document.title;
  const asked = document.getElementById("asked");
  asked.replaceChildren();
  const verdict = document.getElementById("verdict");
  verdict.textContent = "";
  if (run) {
    const text = run.header.asked ?? "";
    asked.append(text.length > 170 ? folded(text) : text);
    verdict.className = run.header.verdict ? outcome(run) : "";
    verdict.textContent = run.header.verdict ?? "";
  }
  const said = runs.flatMap((one, i) => troubles(one).map((text) => (runs.length > 1 ? `${names[i]}: ${text}` : text)));
  document.getElementById("troubles").replaceChildren(...said.map((text) => element("li", "", text)));
}

/** Return a long text as an element that shows the beginning until it is opened. */
function folded(text) {
  const details = element("details");
  const cut = text.lastIndexOf(",", 130) + 1 || 130;
  const summary = element("summary", "", text.slice(0, cut));
  summary.append(element("span", "more", " … more"));
  details.append(summary, element("span", "", text.slice(cut)));
  return details;
}

/** Listen to pointer drags and arrow keys on the splitter between scene and charts. */
function listenToSplitter() {
  const splitter = document.getElementById("splitter");
  const main = document.getElementById("main");
  const set = (percent) => {
    const part = Math.min(85, Math.max(20, percent));
    main.style.setProperty("--scene", `${part}%`);
    splitter.setAttribute("aria-valuenow", String(Math.round(part)));
  };
  splitter.addEventListener("pointerdown", (event) => splitter.setPointerCapture(event.pointerId));
  splitter.addEventListener("pointermove", (event) => {
    if (!splitter.hasPointerCapture(event.pointerId)) return;
    const box = main.getBoundingClientRect();
    set((100 * (event.clientY - box.top)) / box.height);
  });
  splitter.addEventListener("keydown", (event) => {
    const by = { ArrowUp: -4, ArrowDown: 4 }[event.key];
    if (!by || event.altKey) return;
    event.preventDefault();
    set(Number(splitter.getAttribute("aria-valuenow")) + by);
  });
}
