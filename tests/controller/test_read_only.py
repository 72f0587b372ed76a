"""Laws and regions accept read-only measurements, such as an FMU's outputs."""

import numpy as np
import pytest

from controller import VehicleState
from controller.regions import Orientation, Region, Sphere, pack
from cosim.scenario.law_factory import law_of
from cosim.scenario.scenario import load_scenario

FACING = Orientation((1.0, 0.0, 0.0, 0.0), 0.5)
REGIONS = [Region("rock", Sphere((3.0, 0.2, 0.0), 0.5), "out"), Region("face", FACING, "in")]
GOAL = [Region("goal", Sphere((5.0, 0.0, 1.0), 0.5), "in")]


def read_only(numbers):
    array = np.array(numbers, dtype=float)
    array.setflags(write=False)
    return array


def test_regions_are_evaluated_where_the_pose_may_only_be_read():
    room = [np.zeros(2), np.zeros((2, 3)), np.zeros((2, 3)), np.zeros(2)]
    pack(REGIONS).evaluate(read_only([1.0, 0.0, 0.0]), read_only([1.0, 0.0, 0.0, 0.0]), *room)
    assert room[3] == pytest.approx([np.hypot(2.0, 0.2) - 0.5, 0.5])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["paper", "paper-deployable"])
def test_laws_step_as_from_arrays_that_can_be_written_to(name):
    scenario = load_scenario(name)
    numbers = ([0.1, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0], [0.1, 0.0, 0.0, 0.0, 0.0, 0.02], [1.0] * 8)
    forces = {}
    for kind in (np.array, read_only):
        law = law_of(scenario)
        forces[kind] = np.zeros(8 if law.output == "thrusters" else 6)
        state = VehicleState(*map(kind, numbers))
        law.step(state, pack(GOAL), pack(REGIONS), np.ones(2), forces[kind])
    assert np.array_equal(forces[np.array], forces[read_only]) and forces[np.array].any()
