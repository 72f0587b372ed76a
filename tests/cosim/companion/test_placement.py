"""A wrong sign or digit of the scene's origin is shown, and nothing is armed or steered far from the scene."""

import itertools
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as mavlink

from cosim.companion.companion_options import CompanionOptions
from cosim.companion.companion_run import Companion
from cosim.companion.frame_alignment import SceneOrigin
from cosim.companion.placement import MAX_DISTANCE, Placement
from cosim.companion.vehicle_state import ReportedState
from cosim.errors import RunError
from cosim.mavlink.vehicle.geodesy import LocalFrame
from cosim.mavlink.wire.options import ORIGIN
from cosim.scenario.scenario import list_scenarios, load_scenario
from tests.cosim.companion.stand_in import StandIn

SCENE = load_scenario("pipe-inspection")
ARM, STEERS = 400, ("MANUAL_CONTROL", "RC_CHANNELS_OVERRIDE", "SET_POSITION_TARGET_LOCAL_NED", "SET_ATTITUDE_TARGET")


def fly(link, out, origin, **options):
    options = {"profile": "generic", "timeout": 5.0, "arm": True} | options
    companion = Companion(
        load_scenario("pipe-inspection", ["time.duration=0.2"]), link, CompanionOptions(origin=origin, **options)
    )
    notes = []

    def note(state, missing):
        sent = [message.command for _, message in link.sent if message.get_type() == "COMMAND_LONG"]
        notes.append((state, missing, companion.placement, ARM in sent))

    try:
        return companion.run(out, report=False, on_state=note), notes
    finally:
        link.notes = notes


def wrong_origins():
    """Yield the origin with signs changed, swapped, and with each digit of a degree's first three decimals wrong."""
    latitude, longitude = ORIGIN
    yield from ((-latitude, longitude), (latitude, -longitude), (-latitude, -longitude), (longitude, latitude))
    for which, place in itertools.product((0, 1), (10.0, 1.0, 0.1, 0.01, 0.001)):
        for by in (-place, place):
            yield (latitude + by, longitude) if which == 0 else (latitude, longitude + by)


@pytest.mark.parametrize("origin", list(wrong_origins()))
def test_wrong_sign_or_digit_leaves_the_vehicle_far_from_the_scene(origin):
    north, east, _ = LocalFrame(*origin).to_local(*ORIGIN, 0.0)
    here = np.add(SCENE.initial.position, (north, east, 0.0))
    assert Placement(SCENE).distance(here) > MAX_DISTANCE


@pytest.mark.parametrize("name", list_scenarios())
def test_start_and_goal_of_every_shipped_scenario_are_in_its_scene(name):
    scenario = load_scenario(name)
    placement = Placement(scenario)
    assert placement.distance(np.array(scenario.initial.position)) == 0.0
    assert placement.distance(np.add(scenario.initial.position, (1e5, 0.0, 0.0))) > 1e4


@given(st.tuples(*[st.floats(-300.0, 300.0)] * 3))
def test_distance_is_that_of_the_nearest_box_about_a_bounded_region(position):
    regions = [SCENE.goal, *(secondary.region.shape for secondary in SCENE.regions)]
    boxes = [np.array(shape.bounds())[:, :2] for shape in regions if np.isfinite(shape.bounds()).all()]
    boxes.append(np.tile(SCENE.initial.position[:2], (2, 1)))
    nearest = min(np.linalg.norm(np.clip(position[:2], *box) - position[:2]) for box in boxes)
    assert Placement(SCENE).distance(np.array(position)) == pytest.approx(nearest, abs=1e-9)


POOL = load_scenario(
    "pipe-inspection",
    ["regions=[{name='pool',criterion='obstacle',keep='in',gain=100,shape={type='box',center=[0,0,2],size=[10,6,4]}}]"],
)
# axes and signs, by MAV_SENSOR_ROTATION
BEAMS = {0: (0, 1), 2: (1, 1), 4: (0, -1), 6: (1, -1), 24: (2, -1), 25: (2, 1)}


@given(
    st.tuples(*[st.floats(-1.0, 1.0)] * 3), st.sampled_from(sorted(BEAMS)), st.sampled_from(range(4)),
    st.floats(-2.0, 2.0).filter(lambda error: min(abs(error + 0.5), abs(error - 1.1)) > 0.01),
)  # fmt: skip
def test_a_distance_sensor_contradicts_a_scene_that_is_off(fraction, rotation, quarter, error):
    """Beside the walls, floor and surface of a basin, at four headings."""
    position = np.array([0.0, 0.0, 2.0]) + 0.98 * np.array(fraction) * [5.0, 3.0, 2.0]
    angle = quarter * np.pi / 4
    quaternion = np.array([np.cos(angle), 0.0, 0.0, np.sin(angle)])
    axis, sign = BEAMS[rotation]
    if axis < 2:
        ahead = np.rint([np.cos(2 * angle), np.sin(2 * angle)])
        direction = sign * np.array([*(ahead if axis == 0 else [-ahead[1], ahead[0]]), 0.0])
    else:
        direction = np.array([0.0, 0.0, sign])
    free = float(direction @ np.array([0.0, 0.0, 2.0]) + np.abs(direction) @ [5.0, 3.0, 2.0] - direction @ position)
    contradictions = Placement(POOL).contradictions(position, quaternion, {rotation: free + error, 12: 1.0})
    assert (rotation in contradictions) == (not -0.5 < error < 1.1)
    if rotation in contradictions:
        assert float(re.findall(r"[\d.]+", contradictions[rotation])[0]) == pytest.approx(free, abs=0.01)


@pytest.mark.parametrize("north", [0.402, 1.5, 7.5])
def test_the_pool_whose_scene_is_for_the_center_of_the_vehicle_fits(north, monkeypatch):
    """Its walls and floor are 0.4 m outside those of the scene; few evaluations show that, beside a wall too."""
    placement = Placement(load_scenario("examples/pool.toml"))
    ranges = {0: 8.0 - north, 2: 2.5, 4: north, 6: 1.5, 25: 1.9}
    clearance, counts = placement.clearance, []
    monkeypatch.setattr(placement, "clearance", lambda *pose: counts.append(1) or clearance(*pose))
    position, level = np.array([north, 1.5, 0.3]), np.array([1.0, 0.0, 0.0, 0.0])
    assert placement.contradictions(position, level, ranges) == {} and len(counts) < 400
    assert [*placement.contradictions(position, level, ranges | {25: 0.9, 2: 3.3})] == [2, 25]


def test_the_range_of_a_silent_sensor_is_forgotten():
    state = ReportedState()

    def receive(name, at, **fields):
        state.receive(1, 1, getattr(mavlink, f"MAVLink_{name}_message")(**fields), at)

    beat = {"type": 12, "autopilot": 3, "base_mode": 0, "custom_mode": 0, "system_status": 3, "mavlink_version": 3}
    sensor = {"time_boot_ms": 0, "min_distance": 5, "max_distance": 5000, "type": 1, "id": 0, "covariance": 0}
    receive("heartbeat", 0.0, **beat)
    receive("distance_sensor", 0.0, current_distance=180, orientation=25, **sensor)
    receive("distance_sensor", 1.5, current_distance=300, orientation=0, **sensor)
    assert state.ranges == {25: 1.8, 0: 3.0} and state.altitude == 1.8
    receive("heartbeat", 2.1, **beat)
    assert state.ranges == {0: 3.0} and np.isnan(state.altitude)


@pytest.mark.medium
@pytest.mark.parametrize(("depth", "is_warned"), [(0.0, False), (2.0, True)])
def test_a_bottom_elsewhere_than_in_the_scene_is_shown_before_arming(tmp_path, depth, is_warned):
    link = StandIn(profile="generic", armed=False, overrides=["plant.parameters.bottom_depth=4.9"])
    _, notes = fly(link, tmp_path / "run", SceneOrigin(surveyed=(0.0, 0.0, depth)))
    placement = next(text for *_, text, armed in notes if text and armed)
    assert ("; WARNING: below " in placement) == is_warned


@pytest.mark.medium
@pytest.mark.parametrize(
    "origin",
    [
        SceneOrigin(geodetic=(ORIGIN[0], -ORIGIN[1])),
        SceneOrigin(geodetic=(ORIGIN[0] + 0.001, ORIGIN[1])),
        SceneOrigin(surveyed=(500.0, 0.0, 0.0)),
    ],
)
@pytest.mark.parametrize("armed", [False, True])
def test_nothing_is_armed_or_steered_far_from_the_scene(origin, armed, tmp_path):
    link = StandIn(profile="generic", armed=armed)
    with pytest.raises(RunError, match=r"waiting for a position near the scene, not [\d.]+ k?m from everything in it"):
        fly(link, tmp_path / "run", origin)
    assert not link.of_type(*STEERS)
    assert {m.command for m in link.of_type("COMMAND_LONG")} == {511}  # message rates
    assert any("from everything in it" in placement for *_, placement, _ in link.notes)
    assert not (tmp_path / "run").exists()


@pytest.mark.medium
def test_position_and_distances_are_shown_before_the_vehicle_is_armed(tmp_path):
    link = StandIn(profile="generic", armed=False)
    run, notes = fly(link, tmp_path / "run", SceneOrigin(geodetic=ORIGIN))
    assert run.summary["status"] == "completed"
    _, _, placement, armed = next(note for note in notes if note[2])
    assert not armed and any(note[3] for note in notes)
    shown = [float(number) for number in re.findall(r"(-?[\d.]+) m (?:north|east|down)", placement)]
    assert shown == pytest.approx(SCENE.initial.position, abs=0.3)
    assert "goal " in placement and "nearest hard region 'sea bed', " in placement
    assert "from everything" not in placement


@pytest.mark.medium
def test_dry_run_on_a_bench_elsewhere_goes_on_and_says_so(tmp_path):
    link = StandIn(profile="generic")
    run, notes = fly(link, tmp_path / "run", SceneOrigin(geodetic=(51.0, 4.0)), dry_run=True, arm=False)
    assert run.summary["status"] == "dry run"
    assert "km from everything in it" in notes[-1][2]
