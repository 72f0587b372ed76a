"""Regions in figures: moving regions, and regions without a position."""

import re

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from cosim.report.figures.axes_box import Box
from cosim.report.figures.figures import drawings
from cosim.report.figures.style import FigureData, features_of, region_instances, shifts_of
from cosim.results.record import load_record
from cosim.results.wording import verdict
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario


def make_figure_data(folder, name, *overrides):
    scenario = load_scenario(name, [*overrides, "time.duration=2.0"])
    run = run_scenario(scenario, folder, report=False)
    return FigureData(scenario, load_record(run.folder), run.summary)


@pytest.fixture(scope="module")
def inspection(tmp_path_factory):
    """A view that moves, with a goal that moves, at 0.5 m/s."""
    keys = ["goal.velocity=[0.5,0,0]", "regions.view.velocity=[0.5,0,0]", "regions.view.shape.half_angle=0.1"]
    return make_figure_data(tmp_path_factory.mktemp("runs") / "a", "pipe-inspection", *keys, "regions.view.hard=false")


@pytest.fixture(scope="module")
def drifting(tmp_path_factory):
    """Two buoys that approach and recede."""
    keys = ["regions.0.velocity=[-4.0,1.3,0]", "regions.1.velocity=[0.0,1.0,0.0]"]
    return make_figure_data(tmp_path_factory.mktemp("runs") / "b", "moving-obstacle", *keys)


def test_attitude_regions_are_not_drawn_but_features_are(inspection):
    assert [(instance.region.name, instance.faint) for instance in region_instances(inspection)] == [
        ("goal", True), ("goal", True), ("goal", False), ("pipe", False), ("sea bed", False),
    ]  # fmt: skip
    ((name, _, feature),) = features_of(inspection)
    assert name == "view"
    assert feature == pytest.approx([3.0, 3.5, 4.6])


def test_moving_regions_are_drawn_at_start_end_and_closest_approach(drifting):
    first, last, nearest = [
        instance for instance in region_instances(drifting) if instance.region.name == "crossing buoy"
    ]
    assert list(first.shift) == [0.0, 0.0, 0.0]
    assert last.shift == pytest.approx([-8.0, 2.6, 0.0])
    path = drifting.record.stack(["position.x", "position.y", "position.z"])
    center = np.array(nearest.region.shape.center) + shifts_of(drifting.record, "crossing buoy")
    at = np.argmin(np.linalg.norm(path - center, axis=1))
    assert 20 < at < 180
    assert nearest.shift == pytest.approx(center[at] - nearest.region.shape.center)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["inspection", "drifting"])
def test_every_figure_can_be_drawn(request, name):
    data = request.getfixturevalue(name)
    figures = {drawing.name: drawing for drawing in drawings(data)}
    assert "faint" in figures["path-plane"].caption
    labels = [ax.get_ylabel() for ax in figures["clearance"].figure.axes]
    assert labels == (["clearance [m]", "clearance [°]"] if name == "inspection" else ["clearance [m]"])
    (error,) = figures["position-error"].figure.axes
    drawn = error.lines[0].get_ydata()
    center = np.array(data.scenario.goal.center) + shifts_of(data.record, "goal")
    path = data.record.stack(["position.x", "position.y", "position.z"])
    assert drawn == pytest.approx(np.linalg.norm(path - center, axis=1) / np.sqrt(3.0))


LABELED = re.compile(r"\[(m|s|N|N m|W|°|–)\]$")


@pytest.mark.medium
@pytest.mark.parametrize("name", ["inspection", "drifting"])
def test_every_axis_of_every_figure_has_a_name_and_a_unit(request, name):
    for drawing in drawings(request.getfixturevalue(name)):
        for ax in drawing.figure.axes:
            if drawing.name == "path-3d":  # draws its own axes
                names = [text.get_text() for text in ax.texts if LABELED.search(text.get_text())]
                assert names == ["north, NED x [m]", "east, NED y [m]", "depth, NED z [m]"]
                continue
            for axis in (ax.xaxis, ax.yaxis):
                sides = axis.get_tick_params()
                if sides.get("labelleft") or sides.get("labelbottom"):
                    assert LABELED.search(axis.get_label_text()), (drawing.name, axis.get_label_text())


@pytest.mark.slow
@pytest.mark.parametrize("name", ["inspection", "drifting"])
def test_labels_are_not_clipped_and_do_not_overlap(request, name):
    for drawing in drawings(request.getfixturevalue(name)):
        figure = drawing.figure
        renderer = FigureCanvasAgg(figure).get_renderer()
        figure.draw(renderer)
        boxes = [
            (text.get_text(), text.get_window_extent(renderer))
            for text in figure.findobj(Text)
            if text.get_visible() and text.get_text().strip() and shown(text) and not text.get_rotation() % 90.0
        ]  # what is slanted fills little of its box
        assert len(boxes) > 8
        for i, (words, box) in enumerate(boxes):
            assert box.x0 >= 0 and box.y0 >= 0, (drawing.name, words)
            assert box.x1 <= figure.bbox.x1 and box.y1 <= figure.bbox.y1, (drawing.name, words)
            for other, beside in boxes[:i]:
                assert not (box.shrunk(0.9, 0.8).overlaps(beside.shrunk(0.9, 0.8))), (drawing.name, words, other)


def shown(text):
    """Ticks have labels on both sides, of which most are hidden, and beyond the axis too."""
    for ax in text.figure.axes:
        for axis in (ax.xaxis, ax.yaxis):
            for tick in axis.get_major_ticks():
                if text in (tick.label1, tick.label2):
                    low, high = sorted(axis.get_view_interval())
                    return low <= tick.get_loc() <= high
    return True


@pytest.mark.medium
def test_a_view_from_above_has_east_to_the_right_of_north(drifting):
    (figure,) = (drawing.figure for drawing in drawings(drifting) if drawing.name == "path-plane")
    side, above = figure.axes
    north = above.transData.transform([[0.0, 0.0], [1.0, 0.0]])
    east = above.transData.transform([[0.0, 0.0], [0.0, 1.0]])
    assert np.cross(np.append(north[1] - north[0], 0.0), np.append(east[1] - east[0], 0.0))[2] < 0.0
    down = side.transData.transform([[0.0, 0.0], [0.0, 1.0]])
    assert down[1, 1] < down[0, 1]


def test_three_dimensional_view_is_right_handed():
    right, up = Box(np.zeros(3), np.ones(3)).view
    towards = np.cross(right, up)  # the viewer
    assert np.linalg.det(np.array([right, up, towards])) == pytest.approx(1.0)
    assert towards[2] < 0.0 < towards[1]  # above, and in the east
    assert up[2] < 0.0


def test_verdict_gives_angles_in_degrees(inspection):
    least = np.rad2deg(inspection.record["view.clearance"].min())
    assert least < -1.0
    assert f"it kept every hard region but violated view by {-least:.1f}° (soft, where it starts)" in verdict(
        inspection.summary
    )
    assert inspection.summary["clearance_unit"] == {"view": "rad", "pipe": "m", "sea bed": "m"}
    assert inspection.summary["hard"] == ["pipe", "sea bed"]
