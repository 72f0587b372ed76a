"""A function as a law: it receives copies of its inputs, and its output is validated."""

import numpy as np
import pytest

from controller import FunctionLaw, LawError, VehicleState
from controller.regions import Region, Sphere, pack

GOAL = pack([Region("goal", Sphere((3.0, 0.0, 0.0), 0.5), "in")])
ROCKS = pack(
    [
        Region("rock", Sphere((0.0, 2.0, 0.0), 0.5), "out", gain=7.0),
        Region("mud", Sphere((0.0, 0.0, 4.0), 1.0), "out", hard=False, velocity=(0.1, 0.0, 0.0)),
    ]
)
WEIGHTS = np.array([0.75, 0.25])


def state():
    return VehicleState(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(6), np.ones(8))


def test_function_receives_region_positions_and_velocities():
    inputs = []

    def steer(*arguments):
        inputs.extend(arguments)
        return np.arange(6.0)

    forces = np.zeros(6)
    FunctionLaw(steer).step(state(), GOAL, ROCKS, WEIGHTS, forces)
    seen, goal, regions, weights = inputs
    assert forces.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]
    assert seen.position.tolist() == [0.0, 0.0, 0.0] and weights.tolist() == [0.75, 0.25]
    # of spheres by hand: |p - c| - r, 2 (p - c), outside of the goal, outside of both others
    assert goal.clearances.tolist() == [-2.5] and goal.values.tolist() == [8.75]
    assert goal.gradients.tolist() == [[-6.0, 0.0, 0.0]]
    assert regions.clearances.tolist() == [1.5, 3.0] and regions.values.tolist() == [-3.75, -15.0]
    assert regions.gradients.tolist() == [[0.0, 4.0, 0.0], [0.0, 0.0, 8.0]]
    assert regions.gains.tolist() == [7.0, 1.0] and regions.hard.tolist() == [True, False]
    assert regions.velocities.tolist() == [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]


def test_function_receives_copies_of_its_inputs():
    def careless(state, goal, regions, weights):
        for array in (*state, *regions, *goal, weights):
            array[...] = 1
        return np.zeros(6)

    now, weights = state(), WEIGHTS.copy()
    FunctionLaw(careless).step(now, GOAL, ROCKS, weights, np.zeros(6))
    assert not now.position.any() and weights.tolist() == WEIGHTS.tolist()
    assert ROCKS.hard.tolist() == [True, False] and ROCKS.gains.tolist() == [7.0, 1.0] and not GOAL.velocities.any()


@pytest.mark.parametrize(
    "came",
    [
        None, "up", [1.0] * 5, [1.0] * 8, 0.0, [0.0] * 5 + [np.nan], [np.inf] * 6, [1j] * 6, np.full(6, 1.0 + 1j),
        ["1"] * 6, [10**400] * 6, np.zeros((6, 1)), list(range(10_000)), [[1.0, 2.0], [3.0]],
    ],
)  # fmt: skip
def test_invalid_forces_are_rejected(came):
    forces = np.ones(6)
    with pytest.raises(LawError, match=r"law .*:steer returned .*, expected 6 finite numbers \[N and N m\]") as caught:
        FunctionLaw(named("steer", came)).step(state(), GOAL, ROCKS, WEIGHTS, forces)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 400
    assert forces.tolist() == [1.0] * 6


def named(name, result):
    def function(*_):
        return result

    function.__qualname__ = name
    return function


def test_thruster_output_has_one_force_per_thruster():
    law, forces = FunctionLaw(named("steer", [2.0] * 8), output="thrusters"), np.zeros(8)
    law.step(state(), GOAL, ROCKS, WEIGHTS, forces)
    assert law.output == "thrusters" and forces.tolist() == [2.0] * 8


def test_an_object_that_can_be_called_is_named_by_its_class():
    class Pilot:
        def __call__(self, *_):
            return np.zeros(6)

    assert FunctionLaw(Pilot()).name.endswith("test_an_object_that_can_be_called_is_named_by_its_class.<locals>.Pilot")


@pytest.mark.parametrize(
    ("function", "output", "words"),
    [(3, "wrench", "law is 3"), (dict, "wrench", "law is <class"), (print, "force", "'force'")],
)
def test_invalid_law_is_rejected(function, output, words):
    with pytest.raises(LawError, match=words):
        FunctionLaw(function, output)
