"""Addresses of an instance's C functions, for compiled loops that call them without Python."""

from __future__ import annotations

import ctypes
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from plant_fmu.errors import PlantError
from plant_fmu.running.channels import DOUBLES
from plant_fmu.running.instance import Instance
from plant_fmu.variables.former_names import present_name

_NO_REFERENCES = np.empty(0, np.uint32)
_NO_FLAGS = np.empty(0, np.bool_)


class Native(NamedTuple):
    """An instance for callers in C: addresses of C functions, and the buffers that they read and fill."""

    # It is valid while the plant is open, and only one caller may step at a time.

    instance: int  # first argument of every function
    set_values: int  # fmi3SetFloat64, or fmi2SetReal
    get_values: int  # likewise
    do_step: int
    input_references: NDArray[np.uint32]  # (n,) value references of the inputs
    inputs: NDArray[np.float64]  # (n,) values sent by set_values
    output_references: NDArray[np.uint32]  # (m,) value references of the outputs
    outputs: NDArray[np.float64]  # (m,) values filled in by get_values
    results: NDArray[np.int64]  # (5,) event, end and early return of fmi3DoStep, each in the first byte of its element;
    # its status; that of the last set_values, get_values or get_flags
    reached: NDArray[np.float64]  # (1,) s, last successful time of fmi3DoStep; NaN if the FMU does not say
    get_flags: int = 0  # fmi3GetBoolean
    flag_references: NDArray[np.uint32] = _NO_REFERENCES  # (f,) value references of the Boolean outputs
    flags: NDArray[np.bool_] = _NO_FLAGS  # (f,) values filled in by get_flags; none of FMI 2.0
    fmi: int = 3  # FMI version, 2 or 3


def native_calls(instance: Instance, inputs: tuple[str, ...], outputs: tuple[str, ...],
                 flags: tuple[str, ...] = ()) -> Native:  # fmt: skip
    """Return the addresses of an instance's C functions, with buffers."""
    if instance.fmi == 2 and flags:
        raise PlantError(f"{instance.path}: FMI 2.0, expected 3.0 for compiled stepping with Boolean outputs")
    library: Any = instance.fmu.dll

    def address(name: str) -> int:
        return ctypes.cast(library[name], ctypes.c_void_p).value or 0

    return Native(
        instance=ctypes.cast(instance.fmu.component, ctypes.c_void_p).value or 0,
        set_values=address("fmi3SetFloat64" if instance.fmi == 3 else "fmi2SetReal"),
        get_values=address("fmi3GetFloat64" if instance.fmi == 3 else "fmi2GetReal"),
        do_step=address(f"fmi{instance.fmi}DoStep"),
        input_references=_references(instance, inputs),
        inputs=np.zeros(len(inputs)),
        output_references=_references(instance, outputs),
        outputs=np.zeros(len(outputs)),
        results=np.zeros(5, np.int64),
        reached=np.full(1, np.nan),
        get_flags=address(f"fmi{instance.fmi}GetBoolean"),
        flag_references=_references(instance, flags, ("Boolean",)),
        flags=np.zeros(len(flags), np.bool_),
        fmi=instance.fmi,
    )


def stops_early(reached: float, end: float, step: float) -> bool:
    """Return True if the last successful time of a step [s] is before its end [s]; NaN is no time."""
    # an FMU may add up its own small steps, whose sum differs by rounding
    return end - reached > 1e-6 * step + 1e-9 * abs(end)


def _references(instance: Instance, names: tuple[str, ...], types: tuple[str, ...] = DOUBLES) -> NDArray[np.uint32]:
    names = tuple(present_name(name, instance.variables) for name in names)
    for name in names:
        variable = instance.variables.get(name)
        if variable is None or variable.type not in types or variable.shape:
            raise PlantError(f"FMU variable {name!r} is no scalar of type {' or '.join(types)} of {instance.path}")
    return np.array([instance.variables[name].reference for name in names], dtype=np.uint32)
