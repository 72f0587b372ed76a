"""Inputs and outputs of an FMU as arrays, and the prepared C calls that transfer them."""

from __future__ import annotations

import ctypes
import math
import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plant_fmu.model_variables import ModelVariable
from plant_fmu.running.instance import Instance

DOUBLES = ("Real", "Float64")

Call = tuple[Any, tuple[Any, ...]]  # a C function that returns a status, and all its arguments


@dataclass(frozen=True)
class Channel:
    """One input or output."""

    name: str
    unit: str
    description: str


@dataclass(frozen=True, eq=False)
class Channels:
    """Inputs or outputs side by side, in the order of the model description."""

    channels: tuple[Channel, ...]
    values: NDArray[Any]  # (n,) the buffer itself, which changes in place

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels."""
        return tuple(channel.name for channel in self.channels)

    def __len__(self) -> int:
        return len(self.channels)


class BoundCalls:
    """The buffers of an instance, and the calls of a step over them."""

    def __init__(self, instance: Instance, brief: bool = False) -> None:
        # a call that releases the lock wakes every thread that waits for it, mostly to find it taken again
        self._library = ctypes.PyDLL(None, handle=instance.fmu.dll._handle) if brief else instance.fmu.dll
        scalars = [v for v in instance.variables.values() if not v.shape]
        inputs = [v for v in scalars if v.causality == "input" and v.type in DOUBLES]
        outputs = [v for v in scalars if v.causality == "output" and v.type in DOUBLES]
        flags = [v for v in scalars if v.causality == "output" and v.type == "Boolean"]

        self.starts = np.array([float(v.start or 0.0) for v in inputs])
        input_values, output_values = self.starts.copy(), np.zeros(len(outputs))
        flag_type = ctypes.c_int if instance.fmi == 2 else ctypes.c_bool
        flag_buffer = (flag_type * len(flags))()
        self.inputs = Channels(_make_channels(inputs), input_values)
        self.outputs = Channels(_make_channels(outputs), _read_only(output_values))
        self.flags = Channels(_make_channels(flags), _read_only(_as_bools(flag_buffer, ctypes.sizeof(flag_type))))

        # length: arguments of `do_step` [s]
        # now: arguments of `do_step` [s]
        self.now, self.length = ctypes.c_double(), ctypes.c_double()
        # results of `do_step`, of FMI 3.0 alone; last: time up to which it stepped [s], NaN if it does not say
        self.ended, self.last = ctypes.c_bool(), ctypes.c_double(math.nan)
        if instance.fmi == 2:
            names = ("fmi2SetReal", "fmi2GetReal", "fmi2GetBoolean")
        else:
            names = ("fmi3SetFloat64", "fmi3GetFloat64", "fmi3GetBoolean")
        self.set_inputs = self._values_call(instance, names[0], inputs, _doubles(input_values))
        self.get_outputs = self._values_call(instance, names[1], outputs, _doubles(output_values))
        self.get_flags = self._values_call(instance, names[2], flags, flag_buffer)
        self.do_step = self._step_call(instance)

    def _step_call(self, instance: Instance) -> Call:
        component = ctypes.c_void_p(instance.fmu.component)
        if instance.fmi == 2:
            return self._library["fmi2DoStep"], (component, self.now, self.length, instance.no_rollback)
        event, early = ctypes.c_bool(), ctypes.c_bool()
        results = [ctypes.byref(result) for result in (event, self.ended, early, self.last)]
        return self._library["fmi3DoStep"], (component, self.now, self.length, instance.no_rollback, *results)

    def _values_call(self, instance: Instance, name: str, variables: list[ModelVariable], buffer: Any) -> Call:
        if not variables:  # some FMUs refuse a call without variables
            return _no_call, ()
        n = ctypes.c_size_t(len(variables))
        references = (ctypes.c_uint * len(variables))(*(v.reference for v in variables))
        arguments: tuple[Any, ...] = (ctypes.c_void_p(instance.fmu.component), references, n, buffer)
        # a function looked up with [] is an object of its own, without FMPy's conversion of each argument
        return self._library[name], arguments if instance.fmi == 2 else (*arguments, n)


def _no_call() -> int:
    return 0


def _doubles(values: NDArray[np.float64]) -> Any:
    buffer: Any = values
    return (ctypes.c_double * len(values)).from_buffer(buffer) if len(values) else None


def _as_bools(buffer: Any, size: int) -> NDArray[np.bool_]:
    """Return a view of Booleans of `size` bytes each; FMI 2.0's ints are 0 or 1, in the lowest byte."""
    if not len(buffer):
        return np.zeros(0, np.bool_)
    return np.frombuffer(buffer, np.bool_)[0 if sys.byteorder == "little" else size - 1 :: size]


def _make_channels(variables: list[ModelVariable]) -> tuple[Channel, ...]:
    return tuple(Channel(v.name, v.unit, v.description) for v in variables)


def _read_only(values: NDArray[Any]) -> NDArray[Any]:
    view = values.view()
    view.flags.writeable = False
    return view
