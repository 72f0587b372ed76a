"""Times to write and to open the page of a run, and its frame rate in a browser without a graphics card."""

from __future__ import annotations

import contextlib
import importlib.util
import shutil
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from benchmarks.table import Row
from benchmarks.timing import Timing
from cosim.replay.pages import write_replay
from cosim.results.run_result import load_run
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario

STEPS = 120_000
RATIO = "how many times as long as a frame may take at 30 frames a second"

_SCENARIO = "pipe-inspection"  # in it the vehicle and a region move to the end
_STEP = 0.01  # s, step of the scenario
_OTHERS = (3_000, 6_000)  # steps of the shorter runs: half a minute and a minute
_SPEEDS = (1.0, 5.0, 20.0)  # factors of playback
_SIZE = (1280, 800)  # CSS pixels, size of the window
_SMOOTH = Timing((1.0 / 30.0,))  # longest frame of a smooth animation
_PATIENCE = 120.0  # s, timeout of the browser
_NO_BROWSER = "needs chromium, chromedriver and selenium"

# script that plays the page: it returns the time stamp of each painted frame, and the time of each part of it [ms]
_PLAY = """
const [speed, seconds, done] = arguments;
const { page, player } = window.subreach;
const parts = { frame: [page, "paint"], scene: [page.stage, "draw"], charts: [page.board, "point"] };
const times = { start: [], frame: [], scene: [], charts: [] };
for (const [name, [owner, method]] of Object.entries(parts)) {
  owner[method] = (...values) => {
    const before = performance.now();
    Object.getPrototypeOf(owner)[method].apply(owner, values);
    times[name].push(performance.now() - before);
    if (name === "frame") times.start.push(before);
  };
}
player.seek(0);
player.setFollow(true);
player.setSpeed(speed);
player.play();
setTimeout(() => {
  player.pause();
  for (const [owner, method] of Object.values(parts)) delete owner[method];
  done(times);
}, 1000 * (seconds + 0.5));
"""


def measure(steps: int, repeats: int) -> list[Row]:
    """Time pages of a short, a middling and a long run, and play the long one."""
    with tempfile.TemporaryDirectory() as folder, _browser(Path(folder)) as browser:
        rows = []
        for count in (*(other for other in _OTHERS if other < steps), steps):
            page, written = _time_page_write(Path(folder) / f"run-{count}", count, repeats)
            what = f"page of {count * _STEP:g} s, {page.stat().st_size / 1e6:.2f} MB"
            rows.append(Row(f"{what}: written", written))
            rows.append(Row(f"{what}: opened", _time_page_load(browser, page, repeats) if browser else _NO_BROWSER))
        for speed in _SPEEDS:
            rows += _measure_frame_rate(browser, speed, repeats)
    return rows


def _time_page_write(folder: Path, steps: int, repeats: int) -> tuple[Path, Timing]:
    scenario = load_scenario(_SCENARIO, ["arbiter.engine=closed", f"time.duration={steps * _STEP!r}"])
    run = load_run(run_scenario(scenario, folder, report=False).folder)
    times = []
    for _ in range(repeats):
        before = time.perf_counter()
        page = write_replay(run)
        times.append(time.perf_counter() - before)
    return page, Timing(tuple(times))


@contextlib.contextmanager
def _browser(folder: Path) -> Iterator[Any]:
    """Yield a Chromium that renders in software; None if there is none."""
    chromium, chromedriver = shutil.which("chromium"), shutil.which("chromedriver")
    if not (chromium and chromedriver and importlib.util.find_spec("selenium")):
        yield None
        return
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for flag in (
        "headless=new", "no-sandbox", "disable-gpu", "disable-dev-shm-usage", "disable-background-networking",
        "no-first-run", f"user-data-dir={folder / 'profile'}",
    ):  # fmt: skip
        options.add_argument(f"--{flag}")
    driver = webdriver.Chrome(options, Service(chromedriver))
    try:
        driver.set_page_load_timeout(_PATIENCE)
        driver.set_script_timeout(_PATIENCE)
        metrics = {"width": _SIZE[0], "height": _SIZE[1], "deviceScaleFactor": 1, "mobile": False}
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        yield driver
    finally:
        driver.quit()


def _time_page_load(browser: Any, page: Path, repeats: int) -> Timing:
    """Time a page from the request of its address to the first picture."""
    from selenium.webdriver.support.ui import WebDriverWait

    times = []
    for _ in range(repeats):
        browser.get("about:blank")
        before = time.perf_counter()
        browser.get(page.absolute().as_uri())
        ready = WebDriverWait(browser, _PATIENCE, poll_frequency=0.01)
        ready.until(lambda driver: driver.execute_script("return window.subreach?.ready === true"))
        times.append(time.perf_counter() - before)
    return Timing(tuple(times))


def _measure_frame_rate(browser: Any, speed: float, seconds: int) -> list[Row]:
    """Play the open page for some seconds; return rows whose samples are means of the frames in each second."""
    name = f"played at {speed:g}x"
    if not browser:
        return [Row(name, _NO_BROWSER)]
    times = browser.execute_async_script(_PLAY, speed, seconds)
    frame_times = [(start - times["start"][0]) / 1e3 for start in times["start"]]  # s
    frames_by_second = [[i for i, t in enumerate(frame_times) if s <= t < s + 1] for s in range(seconds)]
    counts = sorted(len(frames) for frames in frames_by_second)
    if not counts[0]:
        return [Row(name, "a second went by without a frame")]
    summary = f"{name}: {counts[len(counts) // 2]} frames/s, in the worst second {counts[0]}"
    rows = [Row(summary, Timing(tuple(1.0 / count for count in counts)), "frame at 30/s", _SMOOTH)]
    for part in ("frame", "scene", "charts"):
        means = [_mean([times[part][i] for i in frames if i < len(times[part])]) / 1e3 for frames in frames_by_second]
        what = "all of a frame" if part == "frame" else f"of that, {part}"
        rows.append(Row(f"{name}: {what}", Timing(tuple(means)), "frame at 30/s", _SMOOTH))
    return rows


def _mean(values: Sequence[float]) -> float:
    return sum(values) / max(1, len(values))
