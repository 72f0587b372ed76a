"""How compiled code calls C functions by address: those of an FMI 3.0 FMU, and the clock.

Addresses come as integers in arguments: captured ctypes objects would defeat Numba's cache on disk.
"""

from __future__ import annotations

import ctypes
import sys
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

from controller.jit.jit import jit_noalloc
from plant_fmu.running.native import Native

_WARNING = 1  # the highest status that is no failure
_ENDED = 1  # place among the results of fmi3DoStep of terminateSimulation

_I32, _I64, _F64 = ir.IntType(32), ir.IntType(64), ir.DoubleType()


def _call(builder: Any, address: Any, result: Any, arguments: list[Any]) -> Any:
    function = ir.FunctionType(result, [a.type for a in arguments])
    return builder.call(builder.inttoptr(address, function.as_pointer()), arguments)


def _transfer_code(_context: Any, _address: Any, _instance: Any, _references: Any, _n: Any, _values: Any) -> Any:
    """Call fmi3SetFloat64 or fmi3GetFloat64: (instance, references, n, values, n), all pointers as integers."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        address, instance, references, n, values = arguments
        return _call(builder, address, _I32, [instance, references, n, values, n])

    return types.int32(*[types.int64] * 5), generate


def _do_step_code(_context: Any, _address: Any, _instance: Any, _now: Any, _step: Any, _results: Any) -> Any:
    """Call fmi3DoStep: (instance, now, step, no state before it is restored, four results by pointer).

    The Boolean goes as a whole int, which every calling convention reads a C bool out of; the results, three of them
    Booleans of one byte, go to places of eight bytes each.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        address, instance, now, step, results = arguments
        places = [builder.add(results, ir.Constant(_I64, 8 * i)) for i in range(4)]
        return _call(builder, address, _I32, [instance, now, step, ir.Constant(_I32, 1), *places])

    return types.int32(types.int64, types.int64, types.float64, types.float64, types.int64), generate


def _read_clock_code(_context: Any, _address: Any, _which: Any, _place: Any) -> Any:
    """Call clock_gettime(which, place), or QueryPerformanceCounter(place) where `which` is negative."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        address, which, place = arguments
        allocate: Any = cgutils.alloca_once
        status = allocate(builder, _I32)
        negative = builder.icmp_signed("<", which, ir.Constant(_I64, 0))
        with builder.if_else(negative) as (windows, posix):
            with windows:
                builder.store(_call(builder, address, _I32, [place]), status)
            with posix:
                number = builder.trunc(which, _I32)
                builder.store(_call(builder, address, _I32, [number, place]), status)
        return builder.load(status)

    return types.int32(types.int64, types.int64, types.int64), generate


_transfer: Any = intrinsic(_transfer_code)
_do_step: Any = intrinsic(_do_step_code)
_read_clock: Any = intrinsic(_read_clock_code)


@jit_noalloc
def fmi_set(native: Native) -> bool:
    """Send the inputs, and return whether the FMU took them."""
    n = native.inputs.size
    references, values = native.input_references.ctypes.data, native.inputs.ctypes.data
    status: int = _transfer(native.set_values, native.instance, references, n, values)
    return status <= _WARNING


@jit_noalloc
def fmi_get(native: Native) -> bool:
    """Read the outputs, and return whether the FMU gave them."""
    n = native.outputs.size
    references, values = native.output_references.ctypes.data, native.outputs.ctypes.data
    status: int = _transfer(native.get_values, native.instance, references, n, values)
    return status <= _WARNING


@jit_noalloc
def fmi_do_step(native: Native, now: float, step: float) -> bool:
    """Step from `now` [s] by `step` [s], and return whether the FMU did, and does not ask to end the simulation."""
    status: int = _do_step(native.do_step, native.instance, now, step, native.results.ctypes.data)
    return status <= _WARNING and native.results[_ENDED] == 0


class Clock:
    """A monotonic clock that compiled code can read.

    Attributes
    ----------
    numbers : ndarray of int64, shape (3,)
        Address of the C function, its first argument (negative: none), ticks a second.
    """

    def __init__(self) -> None:
        if sys.platform == "win32":
            kernel = ctypes.WinDLL("kernel32")
            frequency = ctypes.c_int64()
            kernel.QueryPerformanceFrequency(ctypes.byref(frequency))
            function, which, ticks = kernel.QueryPerformanceCounter, -1, frequency.value
        else:
            monotonic = 6 if sys.platform == "darwin" else 1  # CLOCK_MONOTONIC
            function, which, ticks = ctypes.CDLL(None).clock_gettime, monotonic, 1_000_000_000
        address = ctypes.cast(function, ctypes.c_void_p).value or 0
        self.numbers = np.array([address, which, ticks], dtype=np.int64)


@jit_noalloc
def seconds(clock: NDArray[np.int64], workspace: NDArray[np.int64]) -> float:
    """Return the time [s] of a `Clock`'s numbers; `workspace`, shape (2,), is what the C function fills."""
    _read_clock(clock[0], clock[1], workspace.ctypes.data)
    whole, rest = float(workspace[0]), float(workspace[1])
    if clock[1] < 0:
        return whole / float(clock[2])
    return whole + 1e-9 * rest
