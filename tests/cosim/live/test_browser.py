"""The live page in a real browser: displayed motion, and commands by dragging."""

import io
import json
import time

import pytest
from PIL import Image, ImageChops

from cosim.results.record import load_record
from tests.cosim.live.conftest import WAIT
from tests.cosim.replay.browser import CHROMEDRIVER, CHROMIUM, Browser
from tests.threads import interrupt

webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not (CHROMIUM and CHROMEDRIVER), reason="chromium and chromedriver are not installed"),
]

TARGET = 'const r = subreach.runs[0]; return ["x", "y", "z"].map((a) => r.held(`target.${a}`, r.end));'
VIEW = """const {camera, canvas} = subreach.scene, {x, y, width, height} = canvas.getBoundingClientRect();
return [x, y, width, height, camera.width, camera.height, camera.distance, ...camera.eye];"""
TRIES = 5
HELD = "const r = subreach.runs[0]; return subreach.scene.project([arguments[0], arguments[1], arguments[2]]);"


@pytest.fixture
def browser(tmp_path):
    chromium = Browser(tmp_path / "profile")
    yield chromium.driver
    chromium.close()


def until(found):
    deadline = time.monotonic() + WAIT
    while not (value := found()):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return value


def open_page(browser, running, condition="subreach.runs[0]?.rows > 0 && subreach.scene?.drawn.runs.length > 0"):
    until(lambda: running.view._run >= 0)
    browser.get(running.url)
    until(lambda: browser.execute_script(f"return window.subreach?.ready && {condition}"))


def test_the_target_is_dragged_with_the_mouse(browser, live, tmp_path):
    running = live("harbour", "time.duration=600", commands=True, rate=1.0)  # waits for the button
    open_page(browser, running)
    where = "return subreach.scene.drawn.runs[0].position"
    first = until(lambda: browser.execute_script(where))
    assert browser.execute_script("return subreach.scene.drawn.runs[0].current") == [0.05, -0.1, 0]
    browser.execute_script("document.querySelector('#commands [data-armed=true]').click()")
    until(lambda: abs(browser.execute_script(where)[0] - first[0]) > 0.05)
    browser.execute_script('subreach.scene.camera.look("top"); subreach.paint()')

    for _ in range(TRIES):  # a page that is laid out anew meanwhile has another scale
        view, before = browser.execute_script(VIEW), browser.execute_script(TARGET)
        x, y = browser.execute_script(HELD, *before)
        canvas = browser.find_element("id", "scene")
        size = canvas.size
        at = int(x - size["width"] / 2), int(y - size["height"] / 2)
        hand = webdriver.ActionChains(browser).move_to_element_with_offset(canvas, *at)
        hand.click_and_hold().move_by_offset(-20, 30).move_by_offset(-20, 30).perform()
        browser.save_screenshot(str(tmp_path / "dragging.png"))
        webdriver.ActionChains(browser).release().perform()
        after = until(lambda before=before: (now := browser.execute_script(TARGET)) != before and now)
        assert after[2] == before[2]
        if browser.execute_script(VIEW) == view:
            break
    # it has gone as far as the pointer
    x, y = browser.execute_script(HELD, *before)
    assert browser.execute_script(HELD, *after) == pytest.approx([x - 40, y + 60], abs=5)

    # without a mouse: a number beside the scene
    field = browser.find_element("css selector", '#commands input[aria-label="ship, east in meters"]')
    browser.execute_script("arguments[0].scrollIntoView()", field)
    field.send_keys("\ue009" + "a" + "\ue009", "7", "\ue007")  # Control A, 7, Enter
    ship = "const r = subreach.runs[0]; return r.held('ship.shift.y', r.end)"
    until(lambda: browser.execute_script(ship) == 3.0)

    browser.execute_script("document.querySelector('#commands [data-mode=hold]').click()")
    until(
        lambda: browser.execute_script(
            "return document.querySelector('#commands summary').textContent.includes('hold')"
        )
    )
    interrupt(running.thread)
    until(lambda: browser.execute_script("return Boolean(subreach.runs[0].header.verdict)"))
    assert browser.get_log("browser") == []
    done = running.end()
    log = [json.loads(line)["command"] for line in (done.folder / "commands.jsonl").read_text().splitlines()]
    assert [command["command"] for command in log] == ["arm", "set_target", "shift_region", "set_mode"]
    assert log[1]["position"] == pytest.approx(after, abs=1e-12)
    target = load_record(done.folder).stack([f"target.{axis}" for axis in "xyz"])
    assert (target == after).all(axis=1).any()


def test_keep_in_region_is_dragged_by_its_label(browser, live):
    running = live("harbour", "time.duration=12", "regions.ship.keep=in", commands=True, rate=1.0)
    open_page(browser, running)
    name = "return subreach.scene.labels.placed.find((box) => box.of?.region === 1)"
    box = until(lambda: browser.execute_script(name))
    canvas = browser.find_element("id", "scene")
    x, y = (
        box["x"] + box["width"] / 2 - canvas.size["width"] / 2,
        box["y"] + box["height"] / 2 - canvas.size["height"] / 2,
    )
    hand = webdriver.ActionChains(browser).move_to_element_with_offset(canvas, int(x), int(y))
    hand.click_and_hold().move_by_offset(-20, 30).move_by_offset(-20, 30).release().perform()
    moved = "return subreach.runs[0].held('ship.shift.x', subreach.runs[0].end)"
    until(lambda: browser.execute_script(moved) not in (None, 0))


def test_page_lists_regions_and_moving_regions(browser, live):
    running = live("moving-obstacle", "time.duration=4", commands=True, await_arm=False, rate=1.0)
    open_page(browser, running, "subreach.runs[0]?.rows > 20")
    names = "return subreach.runs[0].header.regions.map(({ name, is_dynamic }) => [name, is_dynamic])"
    regions = browser.execute_script(names)
    assert sum(is_dynamic for _, is_dynamic in regions) > 0
    told = browser.execute_script(
        "return subreach.charts.find(({ spec }) => spec.key === 'distances').legend.textContent"
    )
    assert "farther" not in told and not [name for name, is_dynamic in regions if is_dynamic and name in told]
    moving = browser.execute_script(
        "const r = subreach.runs[0]; return r.header.regions.map((_, i) => r.moves(i, r.end))"
    )
    assert {name for (name, _), moves in zip(regions, moving, strict=True) if moves} == {
        "goal", "crossing buoy", "oncoming buoy"
    }  # fmt: skip


def test_scrolled_command_panel_does_not_cover_its_heading(browser, live):
    running = live("harbour", commands=True, await_arm=False)
    open_page(browser, running, "Boolean(subreach.runs[0]?.header.verdict)")
    box = browser.execute_script("return document.querySelector('#commands summary').getBoundingClientRect().toJSON()")
    inside = [box["left"] + 9, box["top"] + 2, box["right"] - 20, box["bottom"] - 2]

    def heading():
        time.sleep(0.3)
        return Image.open(io.BytesIO(browser.get_screenshot_as_png())).convert("RGB").crop(inside)

    before = heading()
    browser.execute_script("document.getElementById('commands').scrollTop = 60")
    assert ImageChops.difference(before, heading()).getbbox() is None
