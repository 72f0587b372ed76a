"""Calls of C functions by address in a step: those of an FMU, and the clock."""

from __future__ import annotations

import ctypes
import sys
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.translator.foreign import BOOL, DOUBLE, INT, POINTER, SIZE, call_c
from plant_fmu.running.native import Native, stops_early

_WARNING = 1  # the highest status that is not a failure
_ENDED, _STEP_STATUS, _TRANSFER_STATUS = 1, 3, 4  # indices in `Native.results`

# arguments of the C functions
_TRANSFER = (POINTER, POINTER, SIZE, POINTER, SIZE)  # fmi3SetFloat64, fmi3GetFloat64
_DO_STEP = (POINTER, DOUBLE, DOUBLE, BOOL, POINTER, POINTER, POINTER, POINTER)  # fmi3DoStep
_TRANSFER_2 = (POINTER, POINTER, SIZE, POINTER)  # fmi2SetReal, fmi2GetReal
_DO_STEP_2 = (POINTER, DOUBLE, DOUBLE, INT)  # fmi2DoStep
_CLOCK_GETTIME, _QUERY_COUNTER = (INT, POINTER), (POINTER,)


class PlantCalls(NamedTuple):
    """The plant's FMU, with the variables that a step sends and reads."""

    native: Native  # inputs and outputs of every step
    effectiveness: Native  # effectiveness of each thruster
    losses: Native  # loss probability of each sensor


def fmi_set(native: Native) -> bool:
    """Set the inputs; return True unless the FMU fails."""
    return _transfer(native, native.set_values, native.input_references, native.inputs)


def fmi_set_one(native: Native, i: int) -> bool:
    """Set one of the inputs; return True unless the FMU fails."""
    return _transfer(native, native.set_values, native.input_references[i : i + 1], native.inputs[i : i + 1])


def fmi_get(native: Native) -> bool:
    """Get the outputs; return True unless the FMU fails."""
    return _transfer(native, native.get_values, native.output_references, native.outputs)


def fmi_get_flags(native: Native) -> bool:
    """Get the Boolean outputs; return True unless the FMU fails."""
    return native.flags.size == 0 or _transfer(native, native.get_flags, native.flag_references, native.flags)


def _transfer(native: Native, function: int, references: NDArray[np.uint32], values: NDArray[Any]) -> bool:
    """Call a function that sets or gets variables; return True unless the FMU fails, or for a plant in Python."""
    n = references.size
    if function == 0 or n == 0:  # some FMUs refuse a call without variables
        return True
    if native.fmi == 2:
        status = call_c(function, _TRANSFER_2, native.instance, references, n, values)
    else:
        status = call_c(function, _TRANSFER, native.instance, references, n, values, n)
    native.results[_TRANSFER_STATUS] = status
    return status <= _WARNING


def fmi_do_step(native: Native, now: float, step: float) -> bool:
    """Step from `now` [s] by `step` [s]; return True unless the FMU fails, stops early or ends the simulation."""
    # The FMU may discard its state before the step.
    out = native.results
    if native.do_step == 0:
        return True
    if native.fmi == 2:
        status = call_c(native.do_step, _DO_STEP_2, native.instance, now, step, 1)
    else:
        status = call_c(
            native.do_step, _DO_STEP, native.instance, now, step, True, out, out[1:], out[2:], native.reached
        )
    out[_STEP_STATUS] = status
    return status <= _WARNING and out[_ENDED] == 0 and not stops_early(native.reached[0], now + step, step)


class Clock:
    """A monotonic clock that C can read."""

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


def seconds(clock: NDArray[np.int64], workspace: NDArray[np.int64]) -> float:
    """Read a clock [s], given by the numbers of a `Clock`; the C function fills `workspace`, shape (2,)."""
    if clock[1] < 0:
        call_c(clock[0], _QUERY_COUNTER, workspace)
        return float(workspace[0]) / float(clock[2])
    call_c(clock[0], _CLOCK_GETTIME, clock[1], workspace)
    return float(workspace[0]) + 1e-9 * float(workspace[1])
