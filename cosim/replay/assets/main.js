// Entry point: show the runs of the page; without runs, connect to a live run on the page's own host.

const NO_RUN =
  "This page holds no run. A run folder has its replay.html; “cosim report --replay RUN” writes one, of several runs too.";
const OLD_BROWSER =
  "This browser cannot unpack the numbers of the run: it has no DecompressionStream. Any browser since 2023 has it.";

/** Return the runs of the page; show the error and return null if they cannot be read. */
async function runsOfPage(page) {
  try {
    return await loadRuns();
  } catch (error) {
    const damaged = `The numbers of this page are damaged and cannot be read; write the page again. (${error.message})`;
    const text = typeof DecompressionStream === "undefined" ? OLD_BROWSER : damaged;
    page.nothing(text);
    page.say(text, "error");
    return null;
  }
}

/** Build the page and show its runs. */
async function main() {
  const page = new Page();
  /**
   * Interface for scripts and tests:
   * - ready: true once the runs are shown, or the page says why there are none
   * - runs: Run[]; player: Player (t, playing, speed, follow, live, play(), pause(), seek(t), stepRows(n), setSpeed(x))
   * - scene: the first Scene (drawn, camera, pick), null while nothing can be drawn; scenes: all, side by side
   * - charts: Chart[]; each has series() -> [{run (index in runs), name, label, time, values}], the arrays that are
   *   drawn, paint(), setWindow(from, to), spec.key
   * - show(runs): replace the runs; paint(): paint now, not with the next frame of the screen
   * - whatIf: the WhatIf of a page that simulates, else null: set(key, value), move(region, from, to), fail(),
   *   reset(), last
   * - page: the Page, as startLive() gets it (theme, setTheme, setSide, showRun, select, refresh, say)
   */
  window.subreach = {
    ready: false,
    whatIf: null,
    page,
    player: page.player,
    get runs() { return page.runs; },
    get scene() { return page.scene(); },
    get scenes() { return page.stage.scenes; },
    get charts() { return page.board.charts; },
    show: (runs) => page.show(runs),
    paint: () => page.paint(),
  };
  const runs = await runsOfPage(page);
  if (runs?.length) {
    await page.show(runs);
    window.subreach.whatIf = await startWhatIf(page);
  } else if (runs && location.protocol.startsWith("http")) await startLive(page);
  else if (runs) page.nothing(NO_RUN);
  window.subreach.ready = true;
}

main();
