"""The deployable law on the plant with faulty measurements, thrusters or regions."""

import numpy as np
import pytest

from controller import LAWS, LawError, VehicleState
from controller.laws.deployable import DeployableGains, DeployableLaw
from controller.regions import Box, HalfSpace, Orientation, Region, Sphere, Visibility, pack
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
        odin.initialise()
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


def test_obstacle_is_avoided_and_goal_reached():
    flight = fly([ROCK])
    assert reached(flight) and within_limits(flight)
    assert flight.clearance(ROCK).min() > 0.0


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
def test_empty_scene_reaches_the_goal():
    assert reached(fly([]))


@pytest.mark.medium
@pytest.mark.parametrize("length", [1.0, 5.0])
def test_nan_measurements_are_bridged_then_the_vehicle_waits(length):
    """Within `coast` the law propagates its model and stops the vehicle; then thrusts are zero until recovery."""
    flight = fly([ROCK], duration=40.0, spoil=lambda t, s: NOWHERE if 2.0 < t < 2.0 + length else s)
    assert within_limits(flight) and reached(flight)
    assert flight.clearance(ROCK).min() > 0.0
    silence = flight.report("time_since_measurement")
    assert silence.max() == pytest.approx(length, abs=0.05)
    rests = silence > DeployableGains().coast
    assert rests.any() == (length > 2.0) and not flight.forces[rests].any()


@pytest.mark.medium
@pytest.mark.parametrize("lost", ["velocity", "position"])
def test_position_or_velocity_alone_suffices(lost):
    """From 2 s to the end: a position without a velocity, or a velocity without a position."""

    def spoil(now, state):
        if now < 2.0:
            return state
        if lost == "velocity":
            return state._replace(velocity_body=np.r_[np.full(3, np.nan), state.velocity_body[3:]])
        return state._replace(position=np.full(3, np.nan))

    flight = fly([ROCK], spoil=spoil)
    assert within_limits(flight) and reached(flight)
    assert flight.clearance(ROCK).min() > 0.0
    assert flight.report("time_since_measurement").max() < 0.05


@pytest.mark.medium
@pytest.mark.parametrize("held", [False, True])
def test_navigation_at_1_hz_is_slower_but_avoids_obstacles(held):
    """Between two measurements there is NaN, or the last value repeated."""
    last = {}

    def spoil(now, state):
        if round(now / 0.02) % 50 == 0:
            last["state"] = state
            return state
        if not held:
            return NOWHERE._replace(
                quaternion=state.quaternion, velocity_body=np.r_[[np.nan] * 3, state.velocity_body[3:]]
            )
        rates = np.r_[last["state"].velocity_body[:3], state.velocity_body[3:]]
        return state._replace(position=last["state"].position, velocity_body=rates)

    flight = fly([ROCK], duration=60.0, spoil=spoil)
    assert within_limits(flight) and reached(flight)
    assert flight.clearance(ROCK).min() > 0.0
    assert flight.report("time_since_measurement").max() < 1.1
    assert flight.report("desired_speed")[flight.time > 3.0].max() < 0.6


@pytest.mark.medium
def test_frozen_sensor_counts_as_failed():
    held = {}

    def freeze(now, state):
        if now < 3.0:
            held["state"] = state
        if 3.0 <= now < 4.0:
            return state._replace(position=held["state"].position, velocity_body=held["state"].velocity_body)
        return state

    flight = fly([ROCK], spoil=freeze)
    assert reached(flight) and flight.clearance(ROCK).min() > 0.0
    assert flight.report("time_since_measurement").max() == pytest.approx(1.0, abs=0.05)


def test_persistent_identical_measurements_are_eventually_accepted():
    """Such as one on a hook, while by the model the current carries it away."""
    held = {}

    def hold(now, state):
        if now >= 10.0:
            held.setdefault("state", state._replace(velocity_body=np.zeros(6)))
            return held["state"]
        return state

    flight = fly([], duration=16.0, spoil=hold, plant={"current.x": -0.4, "current.y": 0.3})
    silence = flight.report("time_since_measurement")
    assert silence[flight.time > 10.0].max() <= DeployableGains().coast + 0.05
    assert (silence[flight.time > 13.0] == 0.0).any()


def test_without_measurements_thrusts_are_zero():
    flight = fly([ROCK], duration=5.0, spoil=lambda t, s: NOWHERE)
    assert not flight.forces.any()


@pytest.mark.medium
def test_infinite_and_unnormalized_measurements_are_ignored():
    bad = VehicleState(np.array([np.inf, 0.0, 0.0]), np.array([5.0, 0.0, 0.0, 0.0]), np.full(6, np.inf), np.ones(8))
    flight = fly([ROCK], spoil=lambda t, s: bad if 2.0 < t < 3.0 else s)
    assert reached(flight) and within_limits(flight) and flight.clearance(ROCK).min() > 0.0


@pytest.mark.medium
def test_single_outlier_is_rejected():
    off = np.array([2.0, -1.0, 1.0])
    calm = fly([ROCK])
    flight = fly([ROCK], spoil=lambda t, s: s._replace(position=s.position + off) if abs(t - 4.0) < 0.001 else s)
    assert np.abs(flight.position - calm.position).max() < 0.1


@pytest.mark.medium
@pytest.mark.parametrize(("weights", "kept"), [((1.0, 0.0), 0), ((0.0, 1.0), 1)])
def test_of_two_conflicting_regions_the_higher_weight_is_satisfied(weights, kept):
    """North of 1 m and south of 0 m at once: the arbiter's weight determines which of them yields."""
    south = Region("south", HalfSpace((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), "in")
    north = Region("north", HalfSpace((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)), "in")
    flight = fly([south, north], weights=weights)
    assert within_limits(flight)
    clearances = [flight.clearance(south)[-1], flight.clearance(north)[-1]]
    assert clearances[kept] > 0.0 > clearances[1 - kept]
    assert flight.report("constraint_slack")[-1] > 0.1


@pytest.mark.medium
def test_equal_weights_share_the_violation():
    south = Region("south", HalfSpace((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), "in")
    north = Region("north", HalfSpace((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)), "in")
    flight = fly([south, north])
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
def test_vehicle_evades_a_moving_obstacle_and_returns():
    comer = Region("comer", Sphere((9.0, 0.0, 2.0), 0.6), "out", velocity=(-0.15, 0.0, 0.0))
    flight = fly([comer], duration=60.0)
    assert flight.clearance(comer).min() > 0.0 and reached(flight)


@pytest.mark.medium
def test_moving_goal_is_tracked():
    goal = Region("goal", Sphere((4.0, 0.0, 2.0), 0.5), "in", velocity=(0.1, 0.15, 0.0))
    flight = fly([], goal=goal, duration=40.0)
    assert flight.clearance(goal)[-500:].min() > 0.0


@pytest.mark.slow
def test_vehicle_escapes_a_pocket_through_its_opening():
    """The way straight ahead is a pocket, open behind: a potential alone would stay in it."""
    walls = [
        Region("front", Box((2.0, 0.0, 2.0), (0.2, 3.0, 3.0)), "out"),
        Region("left", Box((1.0, -1.5, 2.0), (2.2, 0.2, 3.0)), "out"),
        Region("right", Box((1.0, 1.5, 2.0), (2.2, 0.2, 3.0)), "out"),
        Region("top", Box((1.0, 0.0, 0.5), (2.2, 3.0, 0.2)), "out"),
        Region("bottom", Box((1.0, 0.0, 3.5), (2.2, 3.0, 0.2)), "out"),
    ]
    flight = fly(walls, start=(1.0, 0.0, 2.0), duration=60.0)
    assert reached(flight)
    assert min(flight.clearance(wall).min() for wall in walls) > 0.0


@pytest.mark.medium
def test_restoring_force_and_current_are_estimated():
    flight = fly([], duration=40.0, plant={"buoyancy": 1226.25 - 12.0, "current.x": -0.2, "current.y": 0.15})
    assert reached(flight)
    assert flight.law.estimate[0] == pytest.approx(12.0, abs=0.5)
    assert flight.report("current.x")[-1] == pytest.approx(-0.2, abs=0.05)
    assert flight.report("current.y")[-1] == pytest.approx(0.15, abs=0.05)


def angle_to(flight, feature):
    """Return the angle between the body's x axis and the line to a feature, by NumPy alone."""
    e0, e1, e2, e3 = flight.quaternion.T
    ahead = np.column_stack([1 - 2 * (e2**2 + e3**2), 2 * (e1 * e2 + e0 * e3), 2 * (e1 * e3 - e0 * e2)])
    to = np.asarray(feature) - flight.position
    return np.arccos(np.clip(np.sum(ahead * to, axis=1) / np.linalg.norm(to, axis=1), -1.0, 1.0))


@pytest.mark.slow
def test_feature_stays_in_view_along_the_path():
    feature = (4.0, 3.0, 2.0)
    view = Region("view", Visibility(feature, (1.0, 0.0, 0.0), 0.7), "in")
    flight = fly([view], duration=40.0)
    assert reached(flight)
    assert angle_to(flight, feature).max() < 0.7
    assert fly([]).quaternion[-1, 0] == pytest.approx(1.0, abs=1e-3)  # which it would not have turned to by itself
    assert angle_to(fly([], duration=40.0), feature).max() > 1.0


@pytest.mark.medium
def test_soft_view_is_violated_only_briefly():
    feature = (4.0, 3.0, 2.0)
    view = Region("view", Visibility(feature, (1.0, 0.0, 0.0), 0.7), "in", hard=False)
    flight = fly([view], duration=40.0)
    assert reached(flight)
    assert np.mean(angle_to(flight, feature) < 0.7) > 0.7


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
    [({"speed": 0.0}, "speed"), ({"braking_share": 1.5}, "braking_share"), ({"margin": np.nan}, "margin")],
)
def test_invalid_gains_are_rejected_by_name(change, words):
    with pytest.raises(LawError, match=f"law.gains.{words}"):
        LAWS["deployable"].for_vehicle(vehicle_model(ODIN), DeployableGains(**change), LEVEL, PERIOD, 0)
