"""Compiled functions called by their address."""

import pickle

import numba
import numpy as np
import pytest
from numba.core.errors import TypingError

from controller import ControllerError
from controller.jit.function_pointer import call, pointer_to
from controller.jit.jit import jit_internal
from controller.regions import Box, DepthBand, Orientation, Region, Sphere, pack
from cosim.scenario.law_factory import law_of
from cosim.scenario.scenario import load_scenario

compiled_only = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="nothing is compiled")

SPHERE = Region("s", Sphere((1.0, 2.0, 3.0), 0.5), "out")
BAND = Region("d", DepthBand(2.0, 1.0), "in")
BOX = Region("b", Box((5.0, 5.0, 5.0), (1.0, 2.0, 3.0)), "out")
LEVEL = Region("level", Orientation((1.0, 0.0, 0.0, 0.0), 0.2), "in")


@compiled_only
def test_only_regions_that_need_them_bring_the_other_shapes():
    assert pack([SPHERE, BAND])[-2:] == (0, 0)
    packed = pack([SPHERE, BOX])
    assert packed.place != 0 and packed.pose == 0
    packed = pack([SPHERE, LEVEL])
    assert packed.place == 0 and packed.pose != 0


def test_regions_that_were_pickled_find_the_functions_of_their_process():
    packed = pickle.loads(pickle.dumps(pack([SPHERE, BOX])._replace(place=1)))
    assert packed.place == pack([BOX]).place


def test_a_strided_array_is_refused():
    packed, room = pack([SPHERE, BOX]), np.zeros((2, 3))
    with pytest.raises(ControllerError, match=r"evaluate: array is a strided one, expected contiguous ones"):
        packed.evaluate(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(4)[::2], room, room.copy(), np.zeros(2))


@jit_internal
def scaled(numbers, scale):
    total = 0.0
    for number in numbers:
        total += number
    return scale * total


@numba.njit  # not kept on disk, whence no code could be looked at
def by_address(address, numbers, scale):
    return call(address, scaled, (numbers, scale)) + 1.0


@compiled_only
def test_a_function_called_by_its_address_gives_what_it_gives():
    address = pointer_to(scaled, (np.zeros(2), 0.0))
    assert by_address(address, np.array([1.0, 2.0, 4.0]), 3.0) == 22.0
    assert by_address.py_func(0, np.array([1.0, 2.0, 4.0]), 3.0) == 22.0
    assert "scaled" not in next(iter(by_address.inspect_asm().values()))


@compiled_only
def test_other_arguments_than_the_address_is_for_are_refused():
    address = pointer_to(scaled, (np.zeros(2), 0.0))
    with pytest.raises(TypingError, match="by address"):
        by_address(address, np.zeros(4)[::2], 3.0)
    with pytest.raises(TypeError, match="scaled is called by address"):
        pointer_to(scaled, (np.zeros(2), 1))


def test_a_part_can_be_called_from_python_too():
    assert scaled(np.array([1.0, 2.0]), 2.0) == 6.0


@compiled_only
def test_to_read_a_scenario_compiles_no_stage(monkeypatch):
    def told(*_):
        raise AssertionError("compiles")

    monkeypatch.setattr("controller.laws.deployable.law._stages", told)
    law = law_of(load_scenario("paper-deployable"))
    with pytest.raises(AssertionError, match="compiles"):
        len(law.memory)


@compiled_only
def test_a_law_that_was_pickled_finds_the_stages_of_its_process():
    law = law_of(load_scenario("paper-deployable"))
    stages = law.memory.stages
    assert all(stages)
    law.memory = law.memory._replace(stages=type(stages)())  # as if they were elsewhere
    assert pickle.loads(pickle.dumps(law)).memory.stages == stages
