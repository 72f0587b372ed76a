"""The deployable law with invalid inputs, and in geometrically difficult scenes."""

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller import VehicleState
from controller.laws.deployable import DeployableGains, DeployableLaw
from controller.regions import (
    Box,
    Cone,
    Cylinder,
    DepthBand,
    Ellipsoid,
    HalfSpace,
    Orientation,
    Pipe,
    Prism,
    Region,
    Sphere,
    Visibility,
    pack,
)
from cosim.scenario.vehicle_model import vehicle_model
from plant_fmu.vehicle import load_vehicle
from tests.cosim.simulation.test_deployable import fly, reached, within_limits
from tests.examples import examples

ODIN = vehicle_model(load_vehicle("odin"))
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
PERIOD = 0.02
HERE = np.array([0.0, 0.0, 2.0])
# every shape where its slope is hardest to tell: centers, axes, edges, a feature in the camera, half a turn away
SHAPES = (
    Sphere((0.0, 0.0, 2.0), 0.5),
    DepthBand(2.0, 0.2),
    HalfSpace((0.0, 0.0, 2.0), (0.0, 0.6, 0.8)),
    Box((0.0, 0.0, 2.0), (1.0, 1.0, 1.0)),
    Box((0.5, 0.5, 2.5), (1.0, 1.0, 1.0)),
    Cylinder((0.0, 0.0, 1.0), (0.0, 0.0, 3.0), 0.4),
    Ellipsoid((0.0, 0.0, 2.0), (0.5, 0.7, 0.9)),
    Prism(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (0.0, 0.0), (-1.0, 1.0)), 1.0, 3.0),
    Pipe(((-2.0, 0.0, 2.0), (0.0, 0.0, 2.0), (0.0, 2.0, 2.0)), 0.4),
    Cone((0.0, 0.0, 2.0), (1.0, 0.0, 0.0), 0.5, 2.0),
    Orientation((1.0, 0.0, 0.0, 0.0), 0.1),
    Orientation((0.0, 0.0, 0.0, 1.0), 0.1),
    Orientation((0.0, 1.0, 0.0, 0.0), 0.1),
    Visibility((0.0, 0.0, 2.0), (1.0, 0.0, 0.0), 0.3),
    Visibility((-4.0, 0.0, 2.0), (1.0, 0.0, 0.0), 0.3),
)
PLACES = SHAPES[:10]
NUMBERS = (np.nan, np.inf, -np.inf, 1e308, -1e154, 1e20, 1e7, -1e4, 99.0, 1e-308, 0.0)


def law_for(n_regions, period=PERIOD):
    return DeployableLaw(ODIN, DeployableGains(), LEVEL, period, n_regions)


def numbers_of(memory):
    """Return all that a law keeps from step to step, one array behind the other."""
    for name, part in zip(memory._fields, memory, strict=True):
        if name in ("program", "sight"):  # written anew at each step
            continue
        if hasattr(part, "_fields"):
            yield from ((f"{name}.{key}", value) for key, value in numbers_of(part))
        else:
            yield name, part


def assert_sound(law, forces):
    assert np.isfinite(forces).all() and np.abs(forces).max() <= 27.0
    for key, value in numbers_of(law.memory):
        if key not in (
            "state_estimate.last_measured",
            "plan.new_cost.clear_until",
            "expected",
            "bound.bound",
            "bound.last",
            "report.acceleration_error",
            "report.bound",
            "report.drag",
            "report.thrust_limit",
            "attitude.target",
            "speed_limit",
            "thrusters.stuck",
        ):
            assert np.isfinite(value).all(), key


class Spoilt(NamedTuple):
    """One number of what the law is given, and what is put in its place."""

    array: int
    index: int
    number: float


spoilt = st.builds(Spoilt, st.integers(0, 4), st.integers(0, 99), st.sampled_from(NUMBERS))


@settings(max_examples=examples(60), deadline=None)
@given(
    shapes=st.lists(st.tuples(st.sampled_from(SHAPES), st.booleans(), st.booleans()), max_size=6),
    goal=st.tuples(st.sampled_from(PLACES), st.booleans()),
    steps=st.lists(st.lists(spoilt, max_size=3), min_size=1, max_size=12),
)
def test_forces_stay_bounded_under_any_input_and_recover(shapes, goal, steps):
    regions = [Region(str(i), s, "in" if within else "out", hard=hard) for i, (s, within, hard) in enumerate(shapes)]
    law, packed, forces = law_for(len(regions)), pack(regions), np.zeros(8)
    packed_goal = pack([Region("goal", goal[0], "in" if goal[1] else "out")])
    for changes in (*steps, *[[]] * 10):
        given = [HERE.copy(), LEVEL.copy(), np.zeros(6), np.ones(8), np.full(len(regions), 0.5)]
        for array, index, number in changes:
            if given[array].size:
                given[array][index % given[array].size] = number
        law.step(VehicleState(*given[:4]), packed_goal, packed, given[4], forces)
        assert_sound(law, forces)


def test_estimate_recovers_from_a_false_first_measurement():
    """Led away by a false start, the estimate would be no number for ever: it begins anew instead."""
    law, goal, forces = law_for(0, 0.1), pack([Region("goal", Sphere((3.0, 0.0, 2.0), 0.5), "in")]), np.zeros(8)
    far = VehicleState(np.full(3, 9e5), LEVEL, np.array([90.0, -90.0, 90.0, 30.0, 30.0, -30.0]), np.ones(8))
    for k in range(200):
        here = VehicleState(
            HERE + 1e-6 * k, LEVEL, np.zeros(6), np.ones(8)
        )  # to the bit the same would be a dead sensor
        law.step(far if k < 20 else here, goal, pack([]), np.zeros(0), forces)
        assert_sound(law, forces)
    assert law.report[0:3] == pytest.approx(HERE, abs=0.05)
    assert forces.any()


def test_single_false_rate_does_not_change_the_moment_estimate():
    law, goal, forces = law_for(0), pack([Region("goal", Sphere((0.0, 0.0, 2.0), 0.5), "in")]), np.zeros(8)
    for k in range(50):
        rates = np.array([0.0, 0.0, 0.0, 60.0, -60.0, 60.0]) if k == 30 else np.zeros(6)
        law.step(VehicleState(HERE, LEVEL, rates, np.ones(8)), goal, pack([]), np.zeros(0), forces)
    assert np.abs(law.estimate[1:]).max() < 5.0


CAGES = {
    "box": (Box((3.0, 0.0, 2.0), (8.0, 2.0, 2.0)), (0.0, 0.7, 2.0), (9.0, 3.0, 3.5)),
    "turned box": (Box((3.0, 0.0, 2.0), (8.0, 2.0, 2.0), (0.96, 0.0, 0.0, 0.28)), (0.0, -1.0, 2.0), (9.0, 3.0, 2.0)),
    "tunnel": (Cylinder((-1.0, 0.0, 2.0), (9.0, 0.0, 2.0), 0.5), (0.0, 0.1, 2.0), (11.0, 0.3, 2.0)),
    "prism": (
        Prism(((-1.0, -1.0), (7.0, -1.0), (7.0, 5.0), (5.0, 5.0), (5.0, 1.0), (-1.0, 1.0)), 1.0, 3.0),
        (0.0, 0.6, 2.0),
        (10.0, 0.5, 2.0),
    ),
    "cone": (Cone((8.0, 0.0, 2.0), (-1.0, 0.0, 0.0), 0.3, 8.5), (0.0, 0.0, 2.0), (11.0, 0.0, 2.0)),
    "pipe": (Pipe(((-1.0, 0.0, 2.0), (5.0, 0.0, 2.0), (5.0, 4.0, 2.0)), 0.6), (0.0, 0.2, 2.0), (9.0, 0.0, 2.0)),
    "depth band": (DepthBand(2.0, 0.3), (0.0, 0.0, 1.8), (1.0, 0.0, 7.0)),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CAGES)
def test_vehicle_stops_inside_a_keep_in_region(name):
    """The goal lies beyond; on the way there the nearest face is one alongside, not the one ahead."""
    shape, start, goal = CAGES[name]
    cage = Region("cage", shape, "in")
    flight = fly([cage], Region("goal", Sphere(goal, 0.4), "in"), start=start, duration=25.0)
    assert flight.clearance(cage).min() > 0.0 and within_limits(flight)


def wall(x, y, z, size):
    return Region(f"wall {x} {y} {z}", Box((x, y, z), size), "out")


@pytest.mark.slow
@pytest.mark.parametrize("width", [0.6, 0.3])
def test_vehicle_passes_through_the_only_opening(width):
    beside, above = 3.0 + width / 2, (0.2, width + 0.01, 6.0)
    walls = [wall(4.0, side * beside, 2.0, (0.2, 6.0, 8.0)) for side in (-1, 1)]
    walls += [wall(4.0, 0.0, 2.0 + side * beside, above) for side in (-1, 1)]
    flight = fly(walls, Region("goal", Sphere((8.0, 1.0, 2.0), 0.5), "in"), start=(0.0, -1.0, 2.0), duration=50.0)
    assert reached(flight) and within_limits(flight)
    assert min(flight.clearance(each).min() for each in walls) > 0.0


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize(
    "region",
    [
        Region("view", Visibility((-4.0, 0.0, 2.0), (1.0, 0.0, 0.0), 0.4), "in"),
        Region("facing", Orientation((0.0, 0.0, 0.0, 1.0), 0.2), "in"),
    ],
    ids=["a feature right behind", "an attitude half a turn away"],
)
def test_vehicle_turns_from_an_attitude_half_a_turn_away(region):
    """The gradient is zero there, and gives no direction to turn."""
    flight = fly([region], Region("goal", Sphere((0.0, 0.0, 2.0), 0.5), "in"), duration=20.0)
    north = 1.0 - 2.0 * (flight.quaternion[:, 2] ** 2 + flight.quaternion[:, 3] ** 2)  # of the body's x axis
    assert north[0] > 0.99 and north[-1] < -np.cos(0.4)
    assert np.abs(flight.forces[-100:]).max() < 27.0


@pytest.mark.slow
def test_smoothing_halves_noise_induced_thrust_variation():
    rng = np.random.default_rng(8)
    noise = rng.normal(size=(1000, 2, 3)) * np.array([[0.02], [0.01]])

    def noisy(now, state):
        k = round(now / PERIOD)
        velocity = state.velocity_body.copy()
        velocity[:3] += noise[k, 1]
        return state._replace(position=state.position + noise[k, 0], velocity_body=velocity)

    variation = []
    for smoothing in (0.0, DeployableGains().smoothing):
        flight = fly([], duration=20.0, spoil=noisy, gains=DeployableGains(smoothing=smoothing))
        assert reached(flight)
        variation.append(np.abs(np.diff(flight.forces, axis=0)).sum())
    assert variation[1] < 0.5 * variation[0]
