"""A function called again with the same arrays does what Numba's own call does."""

import copy
from typing import NamedTuple

import numpy as np
import pytest
from numba.core import config

from controller.jit.bound_call import BoundCall
from controller.jit.jit import compiled, jit_noalloc

pytestmark = pytest.mark.skipif(config.DISABLE_JIT, reason="is not compiled")


class Parts(NamedTuple):
    """What laws are given: arrays of all kinds, numbers, and more of them inside."""

    vector: np.ndarray
    rows: np.ndarray
    count: np.ndarray
    facts: np.ndarray
    scale: float
    steps: int
    rest: tuple


@jit_noalloc
def _mix(parts, factor, out):
    out[0] = parts.scale * factor * parts.vector.sum()
    out[1] = parts.steps + parts.count[parts.count.size - 1]
    for i in range(parts.rows.shape[0]):
        for j in range(parts.rows.shape[1]):
            out[2] += (i + 1) * (10 * j + 1) * parts.rows[i, j]
    for i in range(parts.facts.size):
        out[3] = 2.0 * out[3] + parts.facts[i]
    first, (second,) = parts.rest
    out[4] = first[0] - second
    parts.vector[0] += 1.0


@compiled
def _grow(values, by):
    values += np.ones(values.size) * by  # an array of its own: references are counted


@jit_noalloc
def _refuse(values):
    if values[0] > 2.0:
        raise ValueError("more than two")
    values[0] += 1.0


def parts():
    rng = np.random.default_rng(5)
    return Parts(
        rng.normal(size=(7, 2))[:, 1],  # in steps
        rng.normal(size=(4, 3))[::-1],  # backwards
        np.arange(3) - 2**40,
        np.array([True, False, True]),
        -0.5,
        -3,
        (np.array([0.25]), (2**40,)),
    )


def test_every_kind_of_argument_comes_as_it_was():
    mine, theirs, out, expected = parts(), parts(), np.zeros(5), np.zeros(5)
    call = BoundCall(_mix)
    for turn in range(6):
        call(mine, 1.5, out)
        _mix.py_func(theirs, 1.5, expected)
        np.testing.assert_array_equal(out, expected)
        np.testing.assert_array_equal(mine.vector, theirs.vector)
        mine.rows[:] += turn  # numbers change between the calls
        theirs.rows[:] += turn


def test_it_is_the_repeated_call_that_is_bound():
    call, factor = BoundCall(_grow), 2.0
    values = np.zeros(3)
    for _ in range(2):
        call(values, factor)
    assert len(call._bound) == 1
    call(values, factor)
    np.testing.assert_array_equal(values, 6.0)


def test_other_arguments_are_never_taken_for_those_before():
    call, factor = BoundCall(_grow), 1.0
    arrays = [np.zeros(n) for n in (3, 3, 1, 1)]
    for turn in range(12):
        for k, values in enumerate(arrays):
            call(values, factor * (k + 1))  # a float of its own each time
            call(values, factor)
        np.testing.assert_array_equal(arrays[0], 2.0 * (turn + 1))
        np.testing.assert_array_equal(arrays[3], 5.0 * (turn + 1))


def test_what_is_bound_stays_where_it_is_and_no_more_of_it_than_a_few():
    call = BoundCall(_grow)
    for n in range(1, 40):
        values = np.zeros(n)
        for _ in range(4):
            call(values, 1.0)
        del values
        assert len(call._bound) <= 8 and len(call._met) <= 8
        for bound in call._bound.values():
            assert bound.words[0] == bound.arguments[0].ctypes.data


def test_what_is_raised_comes_through():
    call, values = BoundCall(_refuse), np.zeros(1)
    for _ in range(3):
        call(values)
    with pytest.raises(ValueError, match="more than two"):
        call(values)
    values[0] = 0.0
    call(values)
    assert values[0] == 1.0


def test_wrong_numbers_of_arguments_are_refused():
    call, values = BoundCall(_refuse), np.zeros(1)
    for _ in range(3):
        call(values)
    for arguments in ((), (values, values)):
        with pytest.raises(TypeError):
            call(*arguments)


def test_a_plain_function_is_called_as_it_is():
    said = []
    call = BoundCall(said.append)
    for _ in range(4):
        call("so")
    assert said == ["so"] * 4


def test_a_copy_has_arrays_of_its_own():
    call, values = BoundCall(_refuse), np.zeros(1)
    for _ in range(3):
        call(values)
    twin, others = copy.deepcopy((call, values))
    for array in (others, others, others):
        array[0] = 0.0
        twin(array)
        assert (array[0], values[0]) == (1.0, 3.0)
