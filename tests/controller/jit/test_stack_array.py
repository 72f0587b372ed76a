"""Small arrays on the stack of compiled functions."""

import pytest
from numba.core.errors import TypingError

from controller.jit.jit import jit_noalloc
from controller.jit.stack_array import zeros


@jit_noalloc
def filled(x, rounds):
    total = 0.0
    for _ in range(rounds):
        matrix, vector = zeros(2, 3), zeros(3)
        for i in range(2):
            for j in range(3):
                matrix[i, j] += x * (3 * i + j)
                vector[j] += matrix[i, j]
        total += vector[0] + 10.0 * vector[1] + 100.0 * vector[2] + 1000.0 * matrix[1, 0] + matrix.size
    return total


def test_they_are_zeros_each_time_and_do_not_overlap():
    for rounds in (1, 3):
        assert filled(0.5, rounds) == filled.py_func(0.5, rounds) == rounds * (1.5 + 25.0 + 350.0 + 1500.0 + 6)


def test_a_shape_that_is_not_written_as_numbers_is_refused():
    with pytest.raises(TypingError):
        jit_noalloc(lambda n: zeros(n)[0])(3)
