"""The numbers behind every drawn curve, read back from the page in a real browser."""

import base64

import numpy as np
import pytest

pytestmark = pytest.mark.slow

_SERIES = """
const packed = (x) => {
  const bytes = new Uint8Array(new Float64Array(x).buffer);
  let text = "";
  for (let i = 0; i < bytes.length; i += 4096) text += String.fromCharCode(...bytes.subarray(i, i + 4096));
  return btoa(text);
};
return window.subreach.charts.map((chart) => chart.series().map((s) => ({
  run: s.run, name: s.name, label: s.label, time: packed(s.time), values: packed(s.values) })));
"""
_SIZES = {"command.size": "command", "actuation.size": "actuation"}


def numbers(text):
    return np.frombuffer(base64.b64decode(text), "<f8")


def expected(page, name):
    """Return what stands behind a curve: a signal of the record, or what is made of such."""
    if name in page.run.record.units:
        return page.recorded(name)
    if name in _SIZES:
        parts = [np.array(page.recorded(f"{_SIZES[name]}.{axis}")) for axis in "XYZ"]
        return np.sqrt(sum(part * part for part in parts)).tolist()
    kind, _, index = name.partition(".phi")
    assert kind == "truth", f"{name} is no signal of the record"
    return [page.run.summary["estimate_true"][int(index) - 1]] * len(page.steps)


def same(a, b):
    return np.array(a).tobytes() == np.array(b).tobytes()


@pytest.mark.parametrize("name", ["docking", "paper"])
def test_chart_curves_equal_the_record_bit_for_bit(name, browser, shown, request):
    page = shown(request.getfixturevalue(name))
    browser.open(page.file)
    charts = browser.js(_SERIES)
    drawn = [series for chart in charts for series in chart]
    assert len(charts) >= 8
    for series in drawn:
        assert series["run"] == 0 and series["label"]
        assert same(numbers(series["time"]), page.recorded("time"))
        assert same(numbers(series["values"]), expected(page, series["name"])), series["name"]
    names = {series["name"] for series in drawn}
    regions = [region["name"] for region in page.header["regions"]]
    assert names >= {f"{region}.clearance" for region in regions}
    assert names >= {f"{kind}.{of}" for kind in ("weight", "membership") for of in ("obstacle", "shape", "depth")}
    assert names >= {"command.size", "actuation.size", "estimate.phi1", "truth.phi1", "position.z", "attitude.yaw"}
    thrusters = {name for name in page.columns if name.startswith("thruster_force[")}
    assert names >= thrusters or not any(any(page.columns[name]) for name in thrusters)


def test_charts_are_painted_and_move_their_cursor(browser, shown, docking):
    browser.open(shown(docking).file)
    visible = "window.subreach.charts.filter((c) => !c.element.hidden)"
    browser.js(f"{visible}.forEach((c) => {{ c.stale = true; c.paint(); }})")
    colors = browser.js(
        f"return {visible}.map((c) => {{ const k = c.canvas; if (!k.width) return 0;"
        "const d = new Uint32Array(k.getContext('2d').getImageData(0, 0, k.width, k.height).data.buffer);"
        "return new Set(d).size; })"
    )
    assert colors and min(colors) > 3
    places = []
    for time in (5.0, 30.0):
        browser.scrub(time)
        places.append(browser.js(f"return {visible}[0].cursor.getBoundingClientRect().left"))
    assert places[1] > places[0] + 50.0


def test_click_in_a_chart_seeks(browser, shown, docking):
    from selenium.webdriver.common.action_chains import ActionChains

    browser.open(shown(docking).file)
    plot = browser.js("return window.subreach.charts[0].plot")
    ActionChains(browser.driver).move_to_element(plot).click().perform()
    browser.settle()
    assert 10.0 < browser.t < 45.0  # the axis is shorter where the vehicle rests
    assert browser.drawn["time"] == browser.t


def test_fired_rules_are_shown_at_the_cursor(browser, shown, paper):
    browser.open(shown(paper).file)
    record = paper.record
    step = int(np.argmax(record["weight.obstacle"]))
    browser.scrub(record["time"][step])
    text = browser.js("return document.getElementById('panel').innerText")
    assert "obstacle exist → α1 high" in text
    assert "SR1" in text
    assert f"{record['membership.obstacle'][step]:.2f}" in text
