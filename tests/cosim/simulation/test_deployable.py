"""The deployable law on the plant with faulty measurements, thrusters or regions."""

import numpy as np
import pytest

from controller import LAWS, LawError, VehicleState
from controller.laws.deployable import DeployableGains, DeployableLaw
from controller.regions import HalfSpace, Orientation, Region, Sphere, Visibility, pack
from controller.regions.region_set import clearance_at
from cosim.scenario.vehicle_model import vehicle_model
from plant_fmu import Plant
from plant_fmu.vehicle import load_vehicle

ODIN = load_vehicle("odin")
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
PERIOD = 0.02
GOAL = Region("goal", Sphere((6.0, 0.0, 2.0), 0.5), "in")
ROCK = Region("rock", Sphere((3.0, 0.1, 2.0), 0.8), "out")
NOWHERE = VehicleState(np.full(3, np.nan), np.full(4, np.nan), np.full(6, np.nan), np.ones(8))


class Flight:
    """What a flight was: true poses, forces and the law's reports, a row a control step."""

    def __init__(self, rows, law, goal, regions):
        self.rows, self.law, self.goal, self.regions = np.array(rows), law, goal, regions
        self.time, self.position, self.quaternion = self.rows[:, 0], self.rows[:, 1:4], self.rows[:, 4:8]
        self.forces = self.rows[:, 8:16]

    def report(self, name):
        return self.rows[:, 16 + [d.name for d in self.law.diagnostics].index(name)]

    def clearance(self, region):
        """Return the true clearance of a region of places at the end of each step."""
        packed, result = pack([region]), []
        for time, position in zip(self.time, self.position, strict=True):
            packed.move_to(time + PERIOD)
            result.append(clearance_at(packed, 0, position.copy()))
        return np.array(result)


def fly(regions, goal=GOAL, weights=None, duration=30.0, spoil=None, start=(0.0, 0.0, 2.0), gains=None, plant=None):
    law = DeployableLaw(vehicle_model(ODIN), gains or DeployableGains(), LEVEL, PERIOD, len(regions))
    packed_goal, packed = pack([goal]), pack(regions)
    weights = np.zeros(len(regions)) if weights is None else np.array(weights, float)
    rows, forces = [], np.zeros(8)
    with Plant(ODIN) as odin:
        odin.set({f"position.{axis}": x for axis, x in zip("xyz", start, strict=True)} | {"substep": 0.01})
        odin.set(plant or {})
        odin.initialize()
        for k in range(round(duration / PERIOD)):
            now, out = k * PERIOD, odin.outputs.values
            state = VehicleState(out[0:3].copy(), out[3:7].copy(), out[7:13].copy(), np.ones(8))
            packed_goal.move_to(now)
            packed.move_to(now)
            law.step(spoil(now, state) if spoil else state, packed_goal, packed, weights, forces)
            odin.inputs.values[:8] = forces
            odin.step(PERIOD)
            rows.append([now, *odin.outputs.values[:7], *forces, *law.report])
    return Flight(rows, law, goal, regions)


def reached(flight):
    return flight.clearance(flight.goal)[-100:].min() >= 0.0


def within_limits(flight):
    return np.isfinite(flight.forces).all() and np.abs(flight.forces).max() <= 27.0


OFF = np.array([2.0, -1.0, 1.0])
UNNORMALIZED = VehicleState(
    np.array([np.inf, 0.0, 0.0]), np.array([5.0, 0.0, 0.0, 0.0]), np.full(6, np.inf), np.ones(8)
)
LEAVING = Region("goal", Sphere((4.0, 0.0, 2.0), 0.5), "in", velocity=(0.1, 0.15, 0.0))


def from_2_s(change):
    return lambda now, state: change(state) if now >= 2.0 else state


FLIGHTS = {
    "a rock": ([ROCK], {}),
    "nothing": ([], {}),
    "only positions": (
        [ROCK],
        {"spoil": from_2_s(lambda s: s._replace(velocity_body=np.r_[np.full(3, np.nan), s.velocity_body[3:]]))},
    ),
    "only velocities": ([ROCK], {"spoil": from_2_s(lambda s: s._replace(position=np.full(3, np.nan)))}),
    "unnormalized": ([ROCK], {"spoil": lambda t, s: UNNORMALIZED if 2.0 < t < 3.0 else s}),
    "an outlier": ([ROCK], {"spoil": lambda t, s: s._replace(position=s.position + OFF) if abs(t - 4.0) < 1e-3 else s}),
    "a moving goal": ([], {"goal": LEAVING, "duration": 40.0}),
}


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("name", FLIGHTS)
def test_goal_is_reached_and_obstacles_are_avoided(name):
    regions, changes = FLIGHTS[name]
    flight = fly(regions, **changes)
    assert reached(flight) and within_limits(flight)
    assert all(flight.clearance(region).min() > 0.0 for region in regions)
    if name.startswith("only"):
        assert flight.report("time_since_measurement").max() < 0.05
    if name == "an outlier":
        assert np.abs(flight.position - fly(regions).position).max() < 0.1
        assert flight.report("rejected")[-1] == 0.5 / (len(flight.time) - 1)  # of two a period, from the second on


@pytest.mark.medium
@pytest.mark.parametrize(("weight", "share"), [(0.0, 1e-3), (1.0, 1e-6)])
def test_active_barrier_has_a_small_bounded_slack(weight, share):
    """A rock alone on the way: the slack is never 0 then, but far below what docs/deployable.md counts as kept."""
    flight = fly([ROCK], weights=[weight])
    yielding, held = flight.report("constraint_slack"), flight.report("barriers") > 0
    assert held.any() and (yielding[held] > 0.0).all() and not yielding[~held].any()
    most = 4 * 27.0 / 187.5  # m/s2, no less than what ODIN's thrusters give
    assert 0.1 * share * most < yielding.max() < share * most


@pytest.mark.medium
@pytest.mark.parametrize("length", [1.0, 5.0])
def test_nan_measurements_are_bridged_then_the_vehicle_waits(length):
    """Within `coast` the law propagates its model and stops the vehicle; then thrusts are zero until recovery."""
    flight = fly([ROCK], duration=40.0, spoil=lambda t, s: NOWHERE if 2.0 < t < 2.0 + length else s)
    assert within_limits(flight) and reached(flight) and flight.clearance(ROCK).min() > 0.0
    silence = flight.report("time_since_measurement")
    assert silence.max() == pytest.approx(length, abs=0.05)
    rests = silence > DeployableGains().coast
    assert rests.any() == (length > 2.0) and not flight.forces[rests].any()


@pytest.mark.medium
@pytest.mark.parametrize("held", [False, True])
def test_navigation_at_1_hz_is_slower_but_avoids_obstacles(held):
    """Between two measurements there is NaN, or the last value repeated."""
    last = NOWHERE

    def spoil(now, state):
        nonlocal last
        if round(now / PERIOD) % 50 == 0:
            last = state
            return state
        kept = last if held else NOWHERE
        rates = np.r_[kept.velocity_body[:3], state.velocity_body[3:]]
        return state._replace(position=kept.position, velocity_body=rates)

    flight = fly([ROCK], duration=60.0, spoil=spoil)
    assert within_limits(flight) and reached(flight) and flight.clearance(ROCK).min() > 0.0
    assert flight.report("time_since_measurement").max() < 1.1
    assert flight.report("desired_speed")[flight.time > 3.0].max() < 0.6


def frozen(begin, end, **changes):
    """Return measurements that repeat the first one since `begin` [s]."""
    held = []

    def spoil(now, state):
        if begin <= now < end:
            held.append(state._replace(**changes))
            return held[0]
        return state

    return spoil


@pytest.mark.medium
def test_frozen_sensor_counts_as_failed():
    flight = fly([ROCK], spoil=frozen(3.0, 4.0))
    assert reached(flight) and flight.clearance(ROCK).min() > 0.0
    assert flight.report("time_since_measurement").max() == pytest.approx(1.0, abs=0.05)


@pytest.mark.medium
def test_persistent_identical_measurements_are_eventually_accepted():
    """Such as one on a hook, while by the model the current carries it away."""
    spoil = frozen(10.0, np.inf, velocity_body=np.zeros(6))
    flight = fly([], duration=16.0, spoil=spoil, plant={"current.x": -0.4, "current.y": 0.3})
    silence = flight.report("time_since_measurement")
    assert silence[flight.time > 10.0].max() <= DeployableGains().coast + 0.05
    assert (silence[flight.time > 13.0] == 0.0).any()


def test_without_measurements_thrusts_are_zero():
    flight = fly([ROCK], duration=5.0, spoil=lambda t, s: NOWHERE)
    assert not flight.forces.any()


@pytest.mark.medium
@pytest.mark.parametrize("weights", [(1.0, 0.0), (0.0, 1.0), (0.0, 0.0)])
def test_weights_decide_which_of_two_conflicting_regions_is_satisfied(weights):
    """North of 1 m and south of 0 m at once; with equal weights both share the violation."""
    south = Region("south", HalfSpace((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), "in")
    north = Region("north", HalfSpace((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)), "in")
    flight = fly([south, north], weights=weights)
    assert within_limits(flight)
    if any(weights):
        clearances = [flight.clearance(south)[-1], flight.clearance(north)[-1]]
        kept = weights.index(1.0)
        assert clearances[kept] > 0.0 > clearances[1 - kept]
        assert flight.report("constraint_slack")[-1] > 0.1
    else:
        assert flight.position[-1, 0] == pytest.approx(0.5, abs=0.02)


@pytest.mark.medium
def test_vehicle_leaves_an_obstacle_it_starts_in():
    inside = Region("inside", Sphere((0.0, 0.2, 2.0), 0.8), "out")
    flight = fly([inside])
    clearance = flight.clearance(inside)
    out = np.flatnonzero(clearance > 0.0)[0]
    assert flight.time[out] < 5.0 and clearance[out:].min() > 0.0 and reached(flight)


@pytest.mark.medium
def test_vehicle_waits_for_a_covered_goal():
    cover = Region("cover", Sphere((6.0, 0.0, 2.0), 0.9), "out")
    flight = fly([cover])
    assert flight.clearance(cover).min() > 0.0
    assert np.abs(np.diff(flight.position[-100:], axis=0)).max() < 0.01


@pytest.mark.medium
def test_restoring_force_and_current_are_estimated():
    flight = fly([], duration=40.0, plant={"buoyancy": 1226.25 - 12.0, "current.x": -0.2, "current.y": 0.15})
    assert reached(flight) and flight.law.estimate[0] == pytest.approx(12.0, abs=0.5)
    assert [flight.report(f"current.{a}")[-1] for a in "xy"] == pytest.approx([-0.2, 0.15], abs=0.05)


@pytest.mark.medium
@pytest.mark.parametrize(("integral", "missing"), [(0.0, (0.03, 0.2)), (0.2, (-0.02, 0.02))])
def test_an_integral_makes_up_for_a_current_that_is_not_estimated(integral, missing):
    gains = DeployableGains(current_bound=1e-3, drag_estimation=0.0, integral=integral)
    flight = fly([], gains=gains, plant={"current.x": -0.5})
    assert missing[0] <= gains.depth - flight.clearance(flight.goal)[-1] <= missing[1]


def angle_to(flight, feature):
    """Return the angle between the body's x axis and the line to a feature, by NumPy alone."""
    e0, e1, e2, e3 = flight.quaternion.T
    ahead = np.column_stack([1 - 2 * (e2**2 + e3**2), 2 * (e1 * e2 + e0 * e3), 2 * (e1 * e3 - e0 * e2)])
    to = np.asarray(feature) - flight.position
    return np.arccos(np.clip(np.sum(ahead * to, axis=1) / np.linalg.norm(to, axis=1), -1.0, 1.0))


@pytest.mark.medium
@pytest.mark.parametrize("hard", [pytest.param(True, marks=pytest.mark.slow), False])
def test_feature_stays_in_view_along_the_path_and_a_soft_view_is_violated_briefly(hard):
    feature = (4.0, 3.0, 2.0)
    flight = fly([Region("view", Visibility(feature, (1.0, 0.0, 0.0), 0.7), "in", hard=hard)], duration=40.0)
    assert reached(flight)
    assert np.mean(angle_to(flight, feature) < 0.7) > 0.7
    if hard:
        assert angle_to(flight, feature).max() < 0.7
        alone = fly([], duration=40.0)  # does not turn by itself
        assert alone.quaternion[-1, 0] == pytest.approx(1.0, abs=1e-3) and angle_to(alone, feature).max() > 1.0


@pytest.mark.medium
def test_vehicle_turns_to_a_feature_behind():
    view = Region("view", Visibility((-4.0, 0.5, 2.0), (1.0, 0.0, 0.0), 0.5), "in")
    flight = fly([view], duration=40.0)
    assert angle_to(flight, (-4.0, 0.5, 2.0))[-1] < 0.5 and reached(flight)


@pytest.mark.medium
def test_an_orientation_region_turns_the_vehicle():
    quarter = (np.cos(np.pi / 4), 0.0, 0.0, np.sin(np.pi / 4))
    facing = Region("facing", Orientation(quarter, 0.2), "in")
    flight = fly([facing])
    assert 2 * np.arccos(abs(flight.quaternion[-1] @ quarter)) < 0.2 and reached(flight)


@pytest.mark.medium
@pytest.mark.parametrize("lost", [2, 6])
def test_reported_failed_thruster_is_not_used(lost):
    def tell(now, state):
        health = np.ones(8)
        health[lost] = 0.0 if 3.0 <= now < 15.0 else 1.0
        return state._replace(thruster_health=health)

    flight = fly([ROCK], spoil=tell)
    told = (flight.time >= 3.0) & (flight.time < 15.0)
    assert not flight.forces[told, lost].any() and flight.forces[~told, lost].any()
    assert reached(flight) and flight.clearance(ROCK).min() > 0.0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"speed": 0.0}, "speed"), ({"braking_share": 1.5}, "braking_share"), ({"max_drift": 0.5}, "max_drift"),
        ({"margin": np.nan}, "margin"),
    ],
)  # fmt: skip
def test_invalid_gains_are_rejected_by_name(change, words):
    with pytest.raises(LawError, match=f"law.gains.{words}"):
        LAWS["deployable"].for_vehicle(vehicle_model(ODIN), DeployableGains(**change), LEVEL, PERIOD, 0)
