"""Arbiter inputs: speeds and times against motion, given signals against NumPy's interpolation."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from controller import VehicleState
from controller.regions import Box, Cone, DepthBand, Orientation, Region, Sphere, Visibility, pack
from cosim.scenario.arbiter_rules import ArbiterRules, InputSignal
from cosim.scenario.criteria import PAPER
from cosim.scenario.region_tables import SecondaryRegion
from cosim.step.arbiter_inputs import compute_inputs, empty_signals, empty_state, pack_inputs, write_arbiter_state
from fuzzy_arbiter import rising
from fuzzy_arbiter.criteria import Criterion, prioritized

GOAL = Region("goal", Sphere((5.0, 0.0, 2.0), 1.0), "in", velocity=(0.1, 0.0, 0.0))
REGIONS = [
    Region("rock", Sphere((3.0, 1.0, 2.0), 0.5), "out", velocity=(-0.2, 0.1, 0.0)),
    Region("band", DepthBand(3.0, 2.0), "in"),
    Region("wall", Box((1.0, -4.0, 2.0), (4.0, 1.0, 4.0)), "out"),
    Region("seen", Cone((2.0, 4.0, 3.0), (0.0, -1.0, -0.2), 0.6, 3.0), "in"),
    Region("level", Orientation((1.0, 0.0, 0.0, 0.0), 0.3), "in"),
    Region("view", Visibility((4.0, 3.0, 3.0), (1.0, 0.0, 0.0), 0.6), "in"),
]
UNIVERSE = (-100.0, 100.0)


def rules(*signals):
    return ArbiterRules(prioritized([Criterion(s.name, membership=rising(*UNIVERSE)) for s in signals]), signals)


def state_of(position, turn, velocity):
    x, y, z, w = Rotation.from_rotvec(turn).as_quat()
    return VehicleState(np.array(position, float), np.array([w, x, y, z]), np.array(velocity, float), np.ones(1))


def clearances_of(regions, state, time):
    packed = pack(regions)
    packed.move_to(time)
    n = len(regions)
    g, slopes, turns, clearances = np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n)
    packed.evaluate(state.position, state.quaternion, g, slopes, turns, clearances)
    return clearances


def inputs_of(signals, state, now=0.0):
    secondary = [SecondaryRegion(region, "obstacle") for region in REGIONS]
    packed = pack_inputs(secondary, PAPER, rules(*signals), 0.2)
    goal, regions = pack([GOAL]), pack(REGIONS)
    goal.move_to(now)
    regions.move_to(now)
    found = empty_signals(packed, len(REGIONS), 3)
    compute_inputs(packed, goal, regions, state, now, clearances_of(REGIONS, state, now), found)
    return found


def test_arbiter_uses_law_estimate_or_measurement():
    measured, decides = state_of([1.0, 2.0, 3.0], [0.1, 0.2, 0.3], [0.4, 0.5, 0.6, 0.7, 0.8, 0.9]), empty_state()
    lost = measured._replace(position=np.full(3, np.nan))
    expected, nothing = np.array([1.1, 2.1, 3.1, 0.3, 0.2, 0.1]), np.full(6, np.nan)
    for state, by, position, velocity in (
        (measured, expected, expected[:3], expected[3:]),
        (measured, nothing, measured.position, measured.velocity_body[:3]),
        (lost, expected, lost.position, lost.velocity_body[:3]),
    ):
        write_arbiter_state(state, by, decides)
        assert np.array_equal(decides.position, position, equal_nan=True)
        assert decides.velocity_body.tolist() == [*velocity, 0.7, 0.8, 0.9]
        assert decides.quaternion.tolist() == measured.quaternion.tolist()


small = st.floats(-1.0, 1.0)
triples = st.tuples(small, small, small)


@given(st.tuples(st.floats(-1.0, 6.0), st.floats(-3.0, 3.0), st.floats(0.5, 4.0)), triples, triples, triples)
@settings(deadline=None)
def test_closing_speed_is_the_rate_of_clearance_decrease(position, turn, linear, rates):
    """Central differences over a motion that SciPy integrates: position along R v, attitude by the body rates."""
    state = state_of(position, np.array(turn) * 0.3, (*linear, *rates))
    found = inputs_of([InputSignal("a", "closing_speed", 1), InputSignal("b", "closing_speed", 0)], state)
    at_once = Rotation.from_rotvec(np.array(turn) * 0.3)

    def moved(h):
        turned = at_once * Rotation.from_rotvec(h * np.array(rates))
        there = np.array(position) + h * at_once.apply(linear)
        return clearances_of([GOAL, *REGIONS], state_of(there, turned.as_rotvec(), (0.0,) * 6), h)

    h = 1e-6
    ahead, behind = (moved(h) - moved(0.0)) / h, (moved(0.0) - moved(-h)) / h
    smooth = np.abs(ahead - behind) < 1e-3  # no edge or corner of a shape is crossed here
    expected = -0.5 * (ahead + behind)
    np.testing.assert_allclose(found.closing_speeds[smooth], expected[smooth], atol=1e-3)


def test_time_to_contact_assumes_constant_velocity():
    """A rock at 2.5 m that comes at 0.2 m/s, a vehicle that goes at 0.3 m/s: met after 5 s; not met when it flees."""
    state = state_of((0.0, 1.0, 2.0), (0.0, 0.0, 0.0), (0.3, 0.1, 0.0, 0.0, 0.0, 0.0))
    signals = [
        InputSignal("a", "approach_time", 1),
        InputSignal("b", "clearance", 1),
        InputSignal("c", "approach_time", 2),
    ]
    found = inputs_of(signals, state)
    assert found.inputs[:2] == pytest.approx([5.0, 2.5], abs=1e-4)
    assert found.approach_times[1] == np.inf and found.inputs[2] == UNIVERSE[1]  # the band is not met
    away = state_of((0.0, 1.0, 2.0), (0.0, 0.0, 0.0), (-0.3, 0.1, 0.0, 0.0, 0.0, 0.0))
    assert inputs_of(signals, away).approach_times[0] == np.inf
    inside = state_of((3.0, 1.0, 2.0), (0.0, 0.0, 0.0), (-0.3, 0.1, 0.0, 0.0, 0.0, 0.0))
    assert inputs_of(signals, inside).approach_times[0] == 0.0


@given(
    st.lists(st.floats(0.0, 50.0), min_size=1, max_size=6, unique=True).map(sorted), st.data(), st.floats(-5.0, 60.0)
)
def test_given_signal_is_linearly_interpolated(times, data, now):
    if len(times) > 1 and min(np.diff(times)) < 1e-6:
        return
    values = data.draw(st.lists(st.floats(-5.0, 5.0), min_size=len(times), max_size=len(times)))
    state = state_of((1.0, 2.0, 3.0), (0.0, 0.0, 0.4), (0.3, -0.4, 1.2, 0.0, 0.0, 0.0))
    given_one = InputSignal("a", "given", course=tuple(zip(times, values, strict=True)))
    found = inputs_of(
        [given_one, InputSignal("b", "time"), InputSignal("c", "depth"), InputSignal("d", "speed")], state, now
    )
    assert found.inputs == pytest.approx([np.interp(now, times, values), now, 3.0, 1.3], abs=1e-9)
