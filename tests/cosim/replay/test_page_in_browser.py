"""The page in a real browser: by keyboard alone, on a phone, light and dark, and with several runs."""

import json

import pytest

from cosim.replay.page import write_page
from cosim.replay.trace import trace_of
from cosim.results.run_result import load_run
from tests.security.test_pages import HOSTILE

pytestmark = pytest.mark.slow

_FOCUS = """
const at = document.activeElement;
const style = getComputedStyle(at);
const ring = (s) => (s.outlineStyle !== "none" && parseFloat(s.outlineWidth) > 0) || s.boxShadow !== "none";
const around = [at, at.parentElement, at.parentElement?.parentElement].filter(Boolean);
return [at.id || at.dataset?.look || at.className || at.tagName, around.some((e) => ring(getComputedStyle(e)))];
"""


def test_keyboard_controls_play_seek_zoom_and_theme(browser, shown, docking):
    from selenium.webdriver.common.keys import Keys

    page = shown(docking)
    browser.open(page.file)
    browser.press(" ")
    assert browser.js("return window.subreach.player.playing")
    browser.wait_until("window.subreach.player.t > 0.2")
    browser.press(" ")
    assert not browser.js("return window.subreach.player.playing")
    browser.press(Keys.HOME)
    assert browser.t == 0.0
    browser.press(Keys.ARROW_RIGHT, Keys.ARROW_RIGHT)
    assert browser.t == page.columns["time"][2]
    browser.press(Keys.ARROW_LEFT)
    assert browser.t == page.columns["time"][1]
    browser.press(Keys.END)
    assert browser.t == page.columns["time"][-1]
    far = browser.js("return window.subreach.scene.project([8, 0, 4])[0] - window.subreach.scene.project([6, 0, 4])[0]")
    browser.press("+", "+", "+")
    near = browser.js(
        "return window.subreach.scene.project([8, 0, 4])[0] - window.subreach.scene.project([6, 0, 4])[0]"
    )
    assert abs(near) > 1.3 * abs(far)
    browser.press("f")
    assert browser.js("return window.subreach.player.follow")
    before = browser.js("return window.subreach.player.speed")
    browser.press("]")
    assert browser.js("return window.subreach.player.speed") > before
    theme = browser.js("return document.documentElement.dataset.theme")
    browser.press("t")
    assert {theme, browser.js("return document.documentElement.dataset.theme")} == {"light", "dark"}
    browser.press("?")
    assert browser.js("return document.querySelector('dialog[open]') !== null")
    browser.press(Keys.ESCAPE)
    assert browser.js("return document.querySelector('dialog[open]') === null")


def test_tab_reaches_every_control_with_visible_focus(browser, shown, docking):
    from selenium.webdriver.common.keys import Keys

    browser.open(shown(docking).file)
    reached, unseen = set(), []
    for _ in range(120):
        browser.driver.switch_to.active_element.send_keys(Keys.TAB)
        name, visible = browser.js(_FOCUS)
        if name in reached and name == "theme":
            break
        reached.add(name)
        if not visible and name != "BODY":
            unseen.append(name)
    assert reached >= {"scene", "scrubber", "play", "speed", "theme", "help-open", "follow", "labels", "iso", "top"}
    assert unseen == []
    unnamed = browser.js(
        "return [...document.querySelectorAll('button, input, select')].filter((e) => e.checkVisibility() &&"
        "!(e.innerText.trim() || e.ariaLabel || e.labels?.length || e.title)).map((e) => e.outerHTML)"
    )
    assert unnamed == []


@pytest.mark.parametrize("size", [(390, 844), (844, 390), (320, 640)])
def test_page_fits_a_phone(browser, shown, docking, size):
    browser.open(shown(docking).file, size)
    assert browser.js("return innerWidth") == size[0]
    assert browser.js("return document.documentElement.scrollWidth") <= size[0]
    outside = browser.js(
        "return ['scene', 'scrubber', 'play', 'charts', 'panel'].map((id) => [id, document.getElementById(id)])"
        ".filter(([, e]) => { const b = e.getBoundingClientRect(); return b.left < -1 || b.right > innerWidth + 1"
        " || !b.width; }).map(([id]) => id)"
    )
    assert outside == []
    if size == (390, 844):
        browser.scrub(10.0)
        browser.shoot("docking-phone")


def test_theme_follows_the_browser_preference(browser, shown, docking):
    found = {}
    for scheme in ("light", "dark"):
        browser.open(shown(docking).file, scheme=scheme)
        browser.scrub(5.0)
        assert browser.js("return document.documentElement.dataset.theme") == scheme
        rgb = browser.js("return getComputedStyle(document.body).backgroundColor.match(/[0-9.]+/g).map(Number)")
        found[scheme] = sum(rgb[:3])
        if scheme == "dark":
            browser.shoot("docking-dark")
    assert found["light"] > 600 and found["dark"] < 200


def test_two_runs_are_overlaid_and_shown_side_by_side(browser, both, docking, paper):
    browser.open(both)
    names = [run["name"] for run in browser.js("return window.subreach.runs.map((r) => ({ name: r.header.name }))")]
    assert names == [docking.folder.name, paper.folder.name]
    browser.land(20.0)
    for run, drawn in zip((docking, paper), browser.drawn["runs"], strict=True):
        index = int(run.record["time"].searchsorted(20.0))
        here = [run.record[f"position.{axis}"][index] for axis in "xyz"]
        assert drawn["position"] == pytest.approx(here, abs=0.05)
    assert browser.js("return window.subreach.scenes.length") == 1
    browser.shoot("two-runs-overlaid")
    browser.press("v")
    scenes = browser.js("return window.subreach.scenes.map((s) => s.drawn)")
    assert [len(scene["runs"]) for scene in scenes] == [1, 1]
    assert [scene["time"] for scene in scenes] == [20.0, 20.0]
    left, right = browser.js("return window.subreach.scenes.map((s) => s.canvas.getBoundingClientRect().toJSON())")
    assert left["right"] <= right["left"] + 1 and left["top"] == right["top"]
    browser.shoot("two-runs-side-by-side")
    series = browser.js("return window.subreach.charts.flatMap((c) => c.series()).map((s) => [s.run, s.name])")
    assert {run for run, name in series if name == "weight.obstacle"} == {0, 1}
    assert browser.logs()[1] == []


def test_names_are_escaped_everywhere(browser, docking, tmp_path):
    trace = json.dumps(trace_of(docking).as_json()).replace("port wall", json.dumps(HOSTILE)[1:-1])
    browser.open(write_page(tmp_path / "replay.html", [json.loads(trace) | {"title": HOSTILE}], HOSTILE))
    browser.scrub(5.0)
    assert HOSTILE.split("Wrack")[1].strip() in browser.js("return document.body.innerText")
    assert browser.js("return document.title").startswith("</script>")
    asked, complaints = browser.logs()
    assert complaints == [] and len(asked) == 1


@pytest.mark.parametrize("kind", ["killed", "gaps", "one row", "interrupted"])
def test_incomplete_run_shows_a_notice(kind, browser, docking, copy_of, spoil, tmp_path):
    run = load_run(spoil(copy_of(docking), kind))
    browser.open(write_page(tmp_path / "replay.html", [trace_of(run).as_json()], "spoilt"))
    browser.scrub(run.record["time"][-1])
    browser.press(" ")
    said = browser.js("return document.getElementById('troubles').innerText")
    assert {"killed": "killed", "gaps": "No number", "one row": "one row", "interrupted": "interrupted"}[kind] in said
    assert browser.logs()[1] == []


def test_page_without_a_run_shows_a_notice(browser, tmp_path):
    browser.open(write_page(tmp_path / "replay.html", [], "nothing"))
    assert "holds no run" in browser.js("return document.body.innerText")
    assert browser.logs()[1] == []


def test_panel_shows_distances_without_signs(browser, shown, docking):
    page = shown(docking)
    browser.open(page.file)
    rows = """return Object.fromEntries([...document.querySelectorAll("#panel .distances li")].map(
        (item) => [item.querySelector(".name").textContent, item.querySelector(".value").textContent]))"""
    for end, word in (("0", " to go"), ("subreach.player.duration", "✓ inside by ")):
        browser.js(f"subreach.player.seek({end})")
        browser.wait_until(f"document.querySelector('#panel .distances').textContent.includes('{word}')")
        told = browser.js(rows)
        row = 0 if end == "0" else -1
        assert float(told["goal"].replace(word, "").removesuffix(" m")) == pytest.approx(
            abs(page.columns["goal.clearance"][row]), rel=0.01
        )
        assert told["roof"].endswith(" m clear")


def test_only_the_six_nearest_regions_are_labeled(browser, shown, shipped_run):
    page = shown(load_run(shipped_run("dense-field", "time.duration=1", "arbiter.engine=closed").folder))
    browser.open(page.file)
    browser.js("subreach.player.seek(subreach.player.duration)")
    browser.wait_until("subreach.scene.labels.placed.length > 0")
    named = set(
        browser.js("""
            const { scene, runs } = subreach;
            const named = scene.labels.placed.filter((box) => box.of);
            return named.map((box) => runs[0].header.regions[box.of.region].name)""")
    )
    rocks = sorted(
        (name.removesuffix(".clearance") for name in page.columns if name.startswith("rock") and ".clearance" in name),
        key=lambda name: page.columns[f"{name}.clearance"][-1],
    )
    assert len(rocks) == 24
    assert {"goal", "water column"} <= named
    assert named & set(rocks)
    assert named & set(rocks) <= set(rocks[:6])
