"""The scene in a real browser: it opens from disk alone, and shows the pose and the colors of the record."""

import re

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from cosim.replay.pages import write_replay
from cosim.results.run_result import load_run
from tests.cosim.records import filled
from tests.cosim.replay.decoding import active_of

pytestmark = pytest.mark.slow

FULL = {"obstacle": "#d55e00", "shape": "#e69f00", "depth": "#56b4e9", None: "#009e73"}
AXES = [f"position.{axis}" for axis in "xyz"]
QUATERNION = [f"quaternion.e{i}" for i in range(4)]


def pose(record, step):
    return [record[name][step] for name in AXES], [record[name][step] for name in QUATERNION]


def test_page_opens_from_disk_without_requests(browser, shown, docking):
    browser.open(shown(docking).file)
    text = browser.js("return document.body.innerText")
    assert docking.scenario.title in text and "The vehicle entered the goal region at" in text
    browser.press("?")
    browser.js("document.querySelector('dialog[open]').close()")
    browser.js("const p = window.subreach.player; p.setSpeed(20); p.play()")
    browser.settle()
    asked, complaints = browser.logs()
    assert [url for url in asked if not url.startswith(("file:", "data:", "blob:"))] == []
    assert sum(url.startswith("file:") for url in asked) == 1
    assert complaints == []
    assert browser.js("return performance.getEntriesByType('resource').map((r) => r.name)") == []


def test_scrubbing_moves_the_vehicle_to_the_recorded_pose(browser, shown, docking):
    page, record = shown(docking), docking.record
    browser.open(page.file)
    for row in np.linspace(0, len(page.steps) - 1, 7).astype(int):
        step = page.steps[row]
        browser.land(record["time"][step])
        assert browser.drawn["time"] == record["time"][step]
        place, attitude = pose(record, step)
        assert browser.drawn["runs"][0]["position"] == place
        assert browser.drawn["runs"][0]["quaternion"] == attitude


def test_pose_is_interpolated_between_rows(browser, shown, docking):
    page, record = shown(docking), docking.record
    browser.open(page.file)
    for row, part in ((40, 0.25), (300, 0.5), (700, 0.9)):
        (p, e), (q, f) = (pose(record, page.steps[row + i]) for i in (0, 1))
        t, u = (record["time"][page.steps[row + i]] for i in (0, 1))
        browser.land(t + part * (u - t))
        drawn = browser.drawn["runs"][0]
        assert drawn["position"] == pytest.approx((1 - part) * np.array(p) + part * np.array(q), abs=1e-9)
        mixed = (1 - part) * np.array(e) + part * np.array(f)
        assert drawn["quaternion"] == pytest.approx(mixed / np.linalg.norm(mixed), abs=1e-9)


def ten_instants(page):
    """Return rows of the page, spread over all who are active in it."""
    who = [active_of(page.header, page.columns, row) for row in range(len(page.steps))]
    rows = [who.index(index) for index in sorted(set(who))]
    more = [row for row in range(len(who)) if row and who[row] != who[row - 1]]
    spread = np.linspace(0, len(who) - 1, 12).astype(int).tolist()
    return sorted(dict.fromkeys([*rows, *more[:4], *spread]))[:10] if len(rows) < 10 else rows[:10]


@pytest.mark.parametrize("name", ["paper", "docking"])
def test_active_region_color_matches_the_record(name, browser, shown, request):
    page = shown(request.getfixturevalue(name))
    record = page.run.record
    browser.open(page.file)
    instants, seen = ten_instants(page), set()
    assert len(instants) == 10
    first = {region["criterion"]: region["color"].lower() for region in reversed(page.header["regions"])}
    assert first == {criterion: FULL[criterion] for criterion in first}
    signals = {
        column: record[column] for column in record.units if column.startswith(("weight.", "membership.", "velocity."))
    }
    signals |= {column: record[column] for column in record.units if column.endswith(".clearance")}
    for row in instants:
        step = page.steps[row]
        expected = active_of(page.header, signals, step)
        browser.land(record["time"][step])
        drawn = browser.drawn["runs"][0]
        assert drawn["active"] == expected
        for i, region in enumerate(page.header["regions"]):
            is_full = drawn["colors"][i].lower() == region["color"].lower()
            assert is_full == (i == expected), (record["time"][step], region["name"], drawn["colors"][i])
        seen.add(expected)
    assert len(seen) >= {"paper": 4, "docking": 2}[name]


SEEN_TEXTS = """
const { context } = subreach.scene, said = [], { fillText } = context;
context.fillText = (...all) => { said.push(all[0]); fillText.apply(context, all); };
subreach.paint();
delete context.fillText;
return said"""


def test_current_is_drawn_as_recorded_and_nothing_in_still_water(browser, shown, shipped_run, docking, paper):
    varies = [f"plant.parameters.current_{of}" for of in ("shear.y=-0.05", "variation.x=0.1", "correlation_time=5")]
    drifting = load_run(shipped_run("depth-transit", *varies, "time.duration=10").folder)
    for run in (drifting, docking, paper):
        page, said = shown(run), set()
        for scheme in ("light", "dark"):
            browser.open(page.file, scheme=scheme)
            for time in (0.0, 3.0, run.record["time"][-1] - 0.5):
                browser.scrub(time)
                row = browser.js("return subreach.runs[0].row(subreach.player.t)")
                water = [page.columns[f"water_velocity.{axis}"][row] for axis in "xyz"]
                drawn = browser.drawn["runs"][0]["current"]
                assert drawn == (water if any(water) else None)
                texts = [text for text in browser.js(SEEN_TEXTS) if text.startswith("current")]
                course = round(np.degrees(np.arctan2(water[1], water[0]))) % 360
                expected = f"current {np.hypot(*water[:2]):.2f} m/s towards {course:03d}°"
                assert texts == ([expected] if any(water) else [])
                in_panel = browser.js("return document.getElementById('panel').innerText")
                assert ("towards" in in_panel) == any(water)
                said |= set(texts)
            browser.shoot(f"current-{run.scenario.name}-{scheme}")
        assert len(said) == {"depth-transit": 3, "docking": 1, "paper": 0}[run.scenario.name]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_page_of_a_record_without_numbers_says_so(value, browser, docking, copy_of, tmp_path):
    folder = copy_of(docking)
    table = pq.read_table(folder / "record.parquet")
    names = [field.name for field in table.schema if field.name != "time" and pa.types.is_floating(field.type)]
    pq.write_table(filled(table, names, slice(200, None), value), folder / "record.parquet")
    browser.open(write_replay(load_run(folder), tmp_path / "page.html"))
    for time in (0.5, 4.0):
        browser.scrub(time)
        text = browser.js("return document.body.innerText") + " ".join(browser.js(SEEN_TEXTS))
        assert "goal" in text and not re.search(r"NaN|Infinity|undefined|null", text)


def test_view_changes_with_time(browser, shown, paper):
    browser.open(shown(paper).file)

    def picture():
        return browser.js("return document.querySelector('canvas').toDataURL()")

    browser.scrub(0.1)
    before = picture()
    browser.scrub(0.2)
    assert picture() != before
    browser.scrub(0.1)
    assert picture() == before


def test_drag_rotates_and_wheel_zooms_the_scene(browser, shown, docking):
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.actions.wheel_input import ScrollOrigin
    from selenium.webdriver.common.by import By

    browser.open(shown(docking).file)
    canvas = browser.driver.find_element(By.CSS_SELECTOR, "canvas")

    def seen():
        goal, ship = [7.1, 0.0, 4.0], [6.8, -3.0, 3.0]
        return np.array([browser.js("return window.subreach.scene.project(arguments[0])", p) for p in (goal, ship)])

    before = seen()
    ActionChains(browser.driver).drag_and_drop_by_offset(canvas, 120, 30).perform()
    browser.settle()
    turned = seen()
    assert np.abs(turned - before).max() > 10.0
    ActionChains(browser.driver).scroll_from_origin(ScrollOrigin.from_element(canvas), 0, -400).perform()
    browser.settle()
    near = seen()
    assert np.linalg.norm(near[1] - near[0]) > 1.05 * np.linalg.norm(turned[1] - turned[0])
