"""The interactive replay in real browsers: dragged, by keyboard, on a phone, and without WebAssembly."""

import pytest

from cosim.replay.pages import replay
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario
from tests.cosim.replay.browser import ARTEFACTS
from tests.cosim.replay.firefox import FIREFOX, Firefox

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]

FLOWN = "subreach.whatIf.took !== null && !subreach.whatIf._flying && subreach.runs.length === 2"
NAME = """
const { scene } = subreach;
for (let y = 60; y < scene.canvas.clientHeight; y += 3) {
  for (let x = 0; x < scene.canvas.clientWidth; x += 3) {
    if (scene.labels.nameAt(x, y)?.region === arguments[0]) return [x, y];
  }
}"""
GOALS = """
const { scene, player } = subreach, said = [];
const { add } = scene.labels;
scene.labels.add = (word) => {
  if (word.of?.region === 0) said.push(word.text.replace("▶ ", ""));
  add.call(scene.labels, word);
};
subreach.paint();
scene.labels.add = add;
return said"""
GOAL = """
const { scene } = subreach, { canvas } = scene, pixels = [];
for (let y = 60; y < canvas.clientHeight; y += 3) {
  for (let x = 0; x < canvas.clientWidth - scene.camera.covered; x += 3) {
    const of = scene.pick(x, y);
    if (of?.region === 0 && of.place === arguments[0]) pixels.push([x, y]);
  }
}
return pixels[Math.floor(pixels.length / 2)]"""
VIEW = """
const { azimuth, elevation, distance, target } = subreach.scene.camera;
return [azimuth, elevation, distance, ...target]"""
ALL_SEEN = """
const { scene, runs } = subreach, { width, height, covered } = scene.camera;
return runs.every((run) => [...run.time].every((t) => {
  const [x, y] = scene.project(run.pose(t).position);
  return x > 0 && x < width - covered && y > 0 && y < height;
}))"""
OVERLAP = """
const groups = document.querySelectorAll("#scene-bar .group");
const boxes = [...groups, document.getElementById("commands")].map((e) => e.getBoundingClientRect());
const apart = (a, b) => a.right <= b.left || b.right <= a.left || a.bottom <= b.top || b.bottom <= a.top;
return boxes.some((a, i) => boxes.slice(i + 1).some((b) => !apart(a, b)))"""


@pytest.fixture(scope="module")
def page(builds, tmp_path_factory):
    folder = tmp_path_factory.mktemp("flies")
    run_scenario(load_scenario("docking", ["time.duration=12"]), folder / "run", report=False)
    return replay([folder / "run"], folder / "page.html", interactive=True)


def opened(browser, page, size=(1280, 720)):
    browser.open(page, size)
    browser.wait_until("subreach.whatIf?.repeats !== null")
    return browser


def end_of(browser, run):
    return browser.js("const r = subreach.runs[arguments[0]]; return r.pose(r.end).position", run)


def test_page_is_small_self_contained_and_reproduces_its_record(browser, page):
    assert page.stat().st_size < 1_000_000
    opened(browser, page)
    asked, complaints = browser.logs()
    assert not complaints and all(url.startswith(("file:", "data:", "blob:", "about:")) for url in asked)
    assert browser.js("return subreach.whatIf.repeats") == 0.0
    assert browser.js("return subreach.runs.length") == 1


def test_page_shows_the_rows_of_a_flight_that_repeats_its_record(browser, page, tmp_path, monkeypatch):
    """Of a long run the file has fewer than its flight; they are among those of the flight."""
    monkeypatch.setattr("cosim.replay.pages.MAX_BYTES_INTERACTIVE", 80_000)
    opened(browser, replay([page.parent / "run"], tmp_path / "page.html", interactive=True))
    rows = browser.js(
        "return [subreach.runs.length, subreach.runs[0].rows, subreach.charts[0].series()[0].time.length]"
    )
    assert rows == [1, 600, 600]
    browser.js("subreach.whatIf.set('plant.current.1', 0.3)")
    browser.wait_until(FLOWN)
    assert browser.js("return subreach.runs[0].header.name") == "as recorded"
    browser.press("r")
    browser.wait_until("subreach.runs.length === 1")
    assert browser.js("return subreach.runs[0].rows") == rows[1]


def test_dragged_goal_is_simulated_and_r_resets(browser, page):
    opened(browser, page)
    at = browser.js(NAME, 0)
    browser.drag(browser.driver.find_element("id", "scene"), at, (-40, -10), (-60, -20))
    browser.wait_until(FLOWN)
    moved = dict(browser.js("return [...subreach.whatIf.values]"))
    assert moved and set(moved) <= {f"goal.center.{axis}" for axis in range(3)}
    goal = browser.js("return subreach.runs[1].header.regions[0].shape.center")
    assert goal[:2] == [moved.get("goal.center.0", 7.1), moved.get("goal.center.1", 0.0)]
    assert max(abs(a - b) for a, b in zip(end_of(browser, 0), end_of(browser, 1), strict=True)) > 0.3
    assert browser.js("return document.getElementById('panel').textContent").count("what if") == 1
    browser.press("r")
    browser.wait_until("subreach.runs.length === 1")
    assert not browser.js("return subreach.whatIf.changed")


def test_each_goal_in_turn_is_labeled_and_dragged(builds, browser, tmp_path):
    goals = ["goal.then=[[6.0,-2.5,3.0],[4.0,-2.0,3.0]]", "goal.stay=1", "time.duration=60"]
    run_scenario(load_scenario("docking", goals), tmp_path / "run", report=False)
    opened(browser, replay([tmp_path / "run"], tmp_path / "page.html", interactive=True))
    assert browser.js(GOALS) == ["present goal (1 of 3)", "next goal (2 of 3)"]
    for place, key in ((1, "goal.then.0"), (0, "goal.center")):
        before = dict(browser.js("return [...subreach.whatIf.values]"))
        at = browser.js(GOAL, place)
        browser.js("subreach.whatIf.took = null")
        browser.drag(browser.driver.find_element("id", "scene"), at, (-15, 25), (-10, 10))
        browser.wait_until(FLOWN)
        moved = dict(browser.js("return [...subreach.whatIf.values]"))
        changed = {of for of in moved if moved[of] != before.get(of)}
        assert changed and changed <= {f"{key}.{axis}" for axis in range(3)}
        browser.shoot("what-if-goals-in-turn")
        browser.js("subreach.whatIf.reset()")
        browser.wait_until("subreach.runs.length === 1")
    shown = browser.js("return subreach.runs[0].column('goal.place')")
    last = shown.index(2.0)
    browser.land(browser.js("return subreach.runs[0].time[arguments[0]]", last))
    assert browser.js(GOALS) == ["present goal (3 of 3)"]


def test_view_follows_the_flight_until_the_reader_turns_it(browser, page):
    opened(browser, page)
    browser.press("2")
    above = browser.js(VIEW)

    def fly(key, value):
        browser.js("subreach.whatIf.took = null; subreach.whatIf.set(...arguments)", key, value)
        browser.wait_until(FLOWN)
        return browser.js(VIEW)

    near = fly("plant.current.1", 0.102)
    assert fly("plant.current.1", 0.104) == near  # which shows all
    for key, value in (("goal.center.0", 20.0), ("goal.center.1", -15.0)):
        far = fly(key, value)
        assert far[:2] == above[:2] and far[2] > 1.2 * near[2] and browser.js(ALL_SEEN)
    browser.press("r")
    browser.wait_until("subreach.runs.length === 1")
    assert browser.js(VIEW) == pytest.approx(above)
    browser.js("subreach.scene.camera.orbit(30, 20)")
    turned = browser.js(VIEW)
    assert fly("goal.center.0", 20.0) == fly("goal.center.0", 25.0) == turned


def test_page_is_operable_by_keyboard(browser, page):
    from selenium.webdriver.common.keys import Keys

    opened(browser, page)
    said = browser.js("return document.getElementById('commands').textContent")
    assert "without a place: heading. Change these" in said
    field = browser.driver.find_element("css selector", "[aria-label='current east in meters a second']")
    field.send_keys(Keys.ARROW_UP, Keys.ARROW_UP)
    browser.wait_until(FLOWN)
    assert dict(browser.js("return [...subreach.whatIf.values]")) == {"plant.current.1": pytest.approx(0.2)}
    assert "current y 0.2 m/s" in browser.js("return document.getElementById('task').textContent")
    choice = browser.driver.find_element("css selector", "[aria-label='thruster that fails']")
    browser.js("subreach.whatIf.took = null")
    choice.send_keys("thruster 3")
    browser.wait_until(FLOWN)
    assert "failure" in browser.js("return subreach.runs[1].header.events.map((event) => event.kind)")
    browser.js("subreach.whatIf.took = null")
    place = browser.driver.find_element("css selector", "[aria-label='port wall, east in meters']")
    place.send_keys(Keys.ARROW_UP)
    browser.wait_until(FLOWN)
    assert "regions.1.shape.center.1" in dict(browser.js("return [...subreach.whatIf.values]"))


@pytest.mark.parametrize("size", [(1280, 720), (390, 844)], ids=["desktop", "phone"])
def test_panels_do_not_cover_buttons(size, browser, page):
    opened(browser, page, size)
    assert not browser.js(OVERLAP)
    browser.js("subreach.whatIf.set('plant.current.1', 0.3)")
    browser.wait_until(FLOWN)
    assert not browser.js(OVERLAP)
    browser.shoot(f"what-if-{size[0]}")


def test_without_webassembly_it_is_the_plain_replay(browser, page):
    hide = browser.driver.execute_cdp_cmd(
        "Page.addScriptToEvaluateOnNewDocument", {"source": "delete window.WebAssembly"}
    )
    try:
        browser.open(page)
        assert browser.js("return subreach.whatIf === null && document.getElementById('commands') === null")
        assert "cannot fly" in browser.js("return document.getElementById('status').textContent")
        browser.press("]")
        assert browser.js("return subreach.runs.length === 1 && subreach.player.speed > 1")
    finally:
        browser.driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", hide)


@pytest.mark.skipif(FIREFOX is None, reason="no Firefox: apt install firefox-esr")
def test_page_runs_in_firefox(page, tmp_path):
    firefox = Firefox(tmp_path)
    try:
        firefox.open(page, (1280, 806))
        firefox.wait_until("subreach.whatIf?.repeats !== null")
        assert firefox.js("return subreach.whatIf.repeats") == 0.0
        firefox.js("subreach.whatIf.set('plant.current.1', 0.3)")
        firefox.wait_until(FLOWN)
        ends = firefox.js("return subreach.runs.map((run) => run.pose(run.end).position)")
        assert max(abs(a - b) for a, b in zip(*ends, strict=True)) > 0.01
        ARTEFACTS.mkdir(parents=True, exist_ok=True)
        firefox.shoot(ARTEFACTS / "what-if-firefox.png")
    finally:
        firefox.close()
