"""The Python text of translated functions compiled by Numba, as an independent translation."""

import dis
import functools
import types

import numba
import numpy as np
from numba.extending import overload

from controller.stack_array import zeros


@functools.cache
def by_numba(function):
    """Return a function, and all that it calls, compiled by Numba."""
    names = {name: _of_numba(value) for name, value in function.__globals__.items() if name in _used(function.__code__)}
    cells = tuple(types.CellType(_of_numba(cell.cell_contents)) for cell in function.__closure__ or ())
    copy = types.FunctionType(
        function.__code__, names | {"__name__": function.__module__, "__builtins__": __builtins__},
        function.__name__, function.__defaults__, cells or None,
    )  # fmt: skip
    return numba.njit(error_model="numpy")(copy)


def _used(code):
    """Return all global names that code refers to."""
    inner = [_used(constant) for constant in code.co_consts if isinstance(constant, types.CodeType)]
    return {step.argval for step in dis.get_instructions(code) if step.opname == "LOAD_GLOBAL"}.union(*inner)


def _of_numba(value):
    if value is zeros:
        return zeros
    if isinstance(value, types.FunctionType) and value.__module__.partition(".")[0] in ("controller", "cosim"):
        return by_numba(value)
    if isinstance(value, types.ModuleType) and value.__name__.startswith("controller."):
        return _Module(value)
    return value


class _Module(types.ModuleType):
    """A module whose functions are compiled by Numba when they are asked for."""

    def __init__(self, module):
        super().__init__(module.__name__)
        self._module = module

    def __getattr__(self, name):
        return _of_numba(getattr(self._module, name))


@overload(zeros)
def _zeros(*shape):
    return lambda *shape: np.zeros(shape)
