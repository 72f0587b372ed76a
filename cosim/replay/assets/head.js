// Head of the page: task, verdict and warnings of the runs; and the splitter between scene and charts.

/** Write the head of the selected run, and the warnings of all runs. */
function showHead(runs, selected) {
  const several = runs.length > 1;
  const names = runNames(runs);
  const { title, task = "", verdict } = runs[selected]?.header ?? { title: document.title };
  byId("title").textContent = (several ? `${names[selected]}: ` : "") + (title || names[selected]);
  byId("task").replaceChildren(task.length > 170 ? folded(task) : task);
  Object.assign(byId("verdict"), { className: verdict ? outcome(runs[selected]) : "", textContent: verdict ?? "" });
  const warnings = runs.flatMap((run, i) => troubles(run).map((text) => (several ? `${names[i]}: ${text}` : text)));
  byId("troubles").replaceChildren(...warnings.map((text) => h("li", {}, text)));
}

/** Return a long text as an element that shows the beginning until it is opened. */
function folded(text) {
  const cut = text.lastIndexOf(",", 130) + 1 || 130;
  return h("details", {}, h("summary", {}, text.slice(0, cut), h("span.more", {}, " … more")), text.slice(cut));
}

/** Listen to pointer drags and arrow keys on the splitter between scene and charts. */
function listenToSplitter() {
  const splitter = byId("splitter");
  const main = byId("main");
  const set = (percent) => {
    const part = clamp(percent, 20, 85);
    main.style.setProperty("--scene", `${part}%`);
    splitter.ariaValueNow = Math.round(part);
  };
  listen(splitter, {
    pointerdown: (event) => splitter.setPointerCapture(event.pointerId),
    pointermove(event) {
      const { top, height } = main.getBoundingClientRect();
      if (splitter.hasPointerCapture(event.pointerId)) set((100 * (event.clientY - top)) / height);
    },
    keydown(event) {
      const by = { ArrowUp: -4, ArrowDown: 4 }[event.key];
      if (!by || event.altKey) return;
      event.preventDefault();
      set(Number(splitter.ariaValueNow) + by);
    },
  });
}
