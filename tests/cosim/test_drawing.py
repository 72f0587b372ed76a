"""Regions in pictures: where those that move were, and those that are at no place left out."""

import numpy as np
import pytest

from controller.regions import Sphere
from cosim.drawing import Story, features_of, labels_of, legend_columns, places_of, shifts_of
from cosim.figures import drawings
from cosim.record import load_record
from cosim.report_words import verdict
from cosim.run import run_scenario
from cosim.scenario import load_scenario


def story_of(folder, name, *overrides):
    scenario = load_scenario(name, [*overrides, "time.duration=2.0"])
    run = run_scenario(scenario, folder, report=False)
    return Story(scenario, load_record(run.folder), run.summary)


@pytest.fixture(scope="module")
def inspection(tmp_path_factory):
    """A view that moves, with a goal that moves, at 0.5 m/s."""
    keys = ["goal.velocity=[0.5,0,0]", "regions.view.velocity=[0.5,0,0]", "regions.view.shape.half_angle=0.1"]
    return story_of(tmp_path_factory.mktemp("runs") / "a", "pipe-inspection", *keys, "regions.view.hard=false")


@pytest.fixture(scope="module")
def drifting(tmp_path_factory):
    """Two buoys that come nearer and then go."""
    keys = ["regions.0.velocity=[-4.0,1.3,0]", "regions.1.velocity=[0.0,1.0,0.0]"]
    return story_of(tmp_path_factory.mktemp("runs") / "b", "moving-obstacle", *keys)


def test_regions_of_attitude_are_at_no_place_but_features_are(inspection):
    assert [(place.region.name, place.faint) for place in places_of(inspection)] == [
        ("goal", True), ("goal", True), ("goal", False), ("pipe", False), ("sea bed", False),
    ]  # fmt: skip
    ((name, _, feature),) = features_of(inspection)
    assert name == "view"
    assert feature == pytest.approx([3.0, 3.5, 4.6])


def test_what_moved_is_drawn_where_it_began_where_it_ended_and_where_it_mattered(drifting):
    first, last, nearest = [place for place in places_of(drifting) if place.region.name == "crossing buoy"]
    assert list(first.shift) == [0.0, 0.0, 0.0]
    assert last.shift == pytest.approx([-8.0, 2.6, 0.0])
    path = drifting.record.stack(["position.x", "position.y", "position.z"])
    centre = np.array(nearest.region.shape.centre) + shifts_of(drifting, "crossing buoy")
    at = np.argmin(np.linalg.norm(path - centre, axis=1))
    assert 20 < at < 180
    assert nearest.shift == pytest.approx(centre[at] - nearest.region.shape.centre)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["inspection", "drifting"])
def test_every_figure_can_be_drawn(request, name):
    story = request.getfixturevalue(name)
    figures = {drawing.name: drawing for drawing in drawings(story)}
    assert "faint" in figures["path-plane"].caption
    labels = [ax.get_ylabel() for ax in figures["clearance"].figure.axes]
    assert labels == (["clearance [m]", "clearance [°]"] if name == "inspection" else ["clearance [m]"])
    (error,) = figures["position-error"].figure.axes
    drawn = error.lines[0].get_ydata()
    centre = np.array(story.scenario.goal.centre) + shifts_of(story, "goal")
    path = story.record.stack(["position.x", "position.y", "position.z"])
    assert drawn == pytest.approx(np.linalg.norm(path - centre, axis=1) / np.sqrt(3.0))


def test_verdict_gives_angles_in_degrees(inspection):
    least = np.rad2deg(inspection.record["view.clearance"].min())
    assert least < -1.0
    assert f"it kept every hard region but violated view by {-least:.1f}° (soft, where it starts)" in verdict(
        inspection.summary
    )
    assert inspection.summary["clearance_unit"] == {"view": "rad", "pipe": "m", "sea bed": "m"}
    assert inspection.summary["hard"] == ["pipe", "sea bed"]


def test_many_regions_share_a_label():
    from controller.regions import Region

    def named(n):
        return [(Region(f"r{i}", Sphere((0.0, 0.0, 0.0), 1.0), "out"), "blue" if i else "green") for i in range(n)]

    assert labels_of(named(3)) == {"r0": "r0", "r1": "r1", "r2": "r2"}
    assert labels_of(named(12)) == {"r0": "r0", "r1": "11 regions"}


@pytest.mark.parametrize(("longest", "columns"), [(1, 12), (13, 5), (93, 1), (200, 1)])
def test_legends_fit_the_figure(longest, columns):
    assert legend_columns(["x", "x" * longest]) == columns
