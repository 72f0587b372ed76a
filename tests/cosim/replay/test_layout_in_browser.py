"""What a reader sees of the whole page: a scene that fills its picture, names beside the vehicle, charts that fit."""

import numpy as np
import pytest

from cosim.results.run_result import load_run

pytestmark = pytest.mark.slow

SIZES = [(1280, 720), (1920, 1080), (390, 844)]
SEEN = """
return arguments[0].map((p) => subreach.scene.project(p))"""
CANVAS = "const { clientWidth, clientHeight } = subreach.scene.canvas; return [clientWidth, clientHeight]"
NEAR = """
const { scene, runs, player } = subreach;
const { position } = runs[0].pose(player.t);
const [x, y] = scene.project(position);
const half = 1.9 * scene._vehicle(runs[0].pose(player.t), 0).size * scene.camera.scaleAt(position);
return scene.labels.placed.filter((box) => box.of)
  .filter((b) => b.x < x + half && b.x + b.width > x - half && b.y < y + half && b.y + b.height > y - half)
  .map((box) => runs[0].header.regions[box.of.region].name)"""
CUT = """
const holder = document.getElementById("charts").getBoundingClientRect();
const boxes = subreach.charts.filter((chart) => !chart.element.hidden).map(({ element, plot, spec }) => {
  const { top, bottom } = element.getBoundingClientRect();
  return { key: spec.key, top, bottom, plot: plot.getBoundingClientRect().height };
});
return boxes.filter(({ top }) => top < holder.bottom - 1)
  .map((box) => ({ ...box, cut: box.bottom > holder.bottom + 1 }))"""
BALL = """
const { scene, runs } = subreach;
const pose = runs[0].pose(0);
const { things, size } = scene._vehicle(pose, 0);
const off = (p) => Math.hypot(...p.map((x, i) => x - pose.position[i])) / size;
const faces = things.filter((thing) => thing.corners);
return faces.filter((face) => face.corners.every((p) => Math.abs(off(p) - 1) < 1e-9)).length / faces.length"""


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", ["docking", "paper"])
def test_path_fills_the_view(name, size, browser, shown, request):
    run = request.getfixturevalue(name)
    browser.open(shown(run).file, size)
    way = run.record.stack([f"position.{axis}" for axis in "xyz"])[::50]
    seen, (width, height) = np.array(browser.js(SEEN, way.tolist())), browser.js(CANVAS)
    assert (seen > 0.0).all() and (seen < [width, height]).all()
    assert np.hypot(*np.ptp(seen, axis=0)) > 0.3 * np.hypot(width, height)  # the regions need room, too


def test_labels_do_not_cover_the_vehicle(browser, shown, docking, paper):
    for run in (docking, paper):
        browser.open(shown(run).file, (1280, 720))
        for part in np.linspace(0.0, 1.0, 9):
            browser.scrub(part * run.record["time"][-1])
            assert browser.js(NEAR) == []


@pytest.mark.parametrize("size", [(1280, 720), (1280, 900), (1920, 1080)])
def test_charts_are_not_clipped(size, browser, shown, docking):
    browser.open(shown(docking).file, size)
    charts = browser.js(CUT)
    assert len(charts) >= 2
    assert [chart["key"] for chart in charts if chart["cut"] or chart["plot"] < 60.0] == []


def test_time_axis_is_broken_before_a_settled_tail(browser, shown, docking):
    browser.open(shown(docking).file, (1280, 720))
    rest, end = browser.js("return [subreach.player.rest, subreach.player.end]")
    assert docking.summary["settle_time"] < rest < 0.7 * end
    frame = "const { frame } = subreach.charts[0]; return [frame.left, frame.right, ...arguments[0].map(frame.x)]"
    left, right, *places = browser.js(frame, [0.0, rest, end])
    assert places == pytest.approx([left, left + 0.86 * (right - left), right])
    to_and_fro = "return arguments[0].map((t) => subreach.charts[0].frame.time(subreach.charts[0].frame.x(t)))"
    times = np.linspace(0.0, end, 13)
    assert browser.js(to_and_fro, times.tolist()) == pytest.approx(times)
    browser.land(0.5 * (rest + end))  # by the scrubber, which is broken too
    browser.js("subreach.page.board.setWindow(20, 50)")
    browser.settle()
    left, right, middle = browser.js(frame, [35.0])
    assert middle == pytest.approx(0.5 * (left + right))


def test_time_axis_of_a_moving_run_is_unbroken(browser, shown, shipped_run):
    run = load_run(shipped_run("docking", "time.duration=6", "arbiter.engine=closed").folder)
    browser.open(shown(run).file)
    assert not browser.js("return subreach.charts[0].frame.axis.broken || subreach.page.timeline.axis.broken")


def test_panel_reports_rest_in_the_goal(browser, shown, docking):
    browser.open(shown(docking).file)
    browser.scrub(docking.record["time"][-1])
    text = browser.js("return document.querySelector('#panel .now').innerText")
    assert "At rest in the goal region, inside by" in text
    assert "weight" not in text
    assert browser.drawn["runs"][0]["active"] == 0


def test_escape_closes_the_chart_menu(browser, shown, docking):
    browser.open(shown(docking).file)
    browser.js("document.querySelector('#charts-menu summary').click()")
    browser.js("document.querySelector('#charts-choice input').focus()")
    menu = "const menu = document.getElementById('charts-menu');"
    assert browser.js(f"{menu} return menu.open")
    browser.press("\ue00c")
    assert not browser.js(f"{menu} return menu.open")
    assert browser.js(f"{menu} return document.activeElement === menu.querySelector('summary')")
    browser.press(" ", "\ue00c")
    assert not browser.js(f"{menu} return menu.open")


def test_spherical_hull_is_drawn_as_a_sphere(browser, shown, docking, paper):
    browser.open(shown(paper).file)  # flies ODIN
    assert browser.js(BALL) > 0.4
    browser.open(shown(docking).file)
    assert browser.js(BALL) == 0.0


def test_region_curves_of_one_criterion_have_distinct_colors(browser, shown, docking):
    for scheme in ("light", "dark"):
        browser.open(shown(docking).file, scheme=scheme)
        lines = "[...subreach.charts[0].legend.querySelectorAll('line')]"
        colors = browser.js(f"return {lines}.map((line) => line.getAttribute('stroke'))")
        assert len(colors) == 6 and len(set(colors)) == 6
