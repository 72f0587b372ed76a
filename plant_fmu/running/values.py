"""Check values against the type of their variable before an FMU receives them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from plant_fmu.errors import PlantError
from plant_fmu.running.channels import DOUBLES

Value = float | int | bool | str

_REALS = (*DOUBLES, "Float32")
_INTEGERS = {  # number of bits of each type of whole numbers, and True if signed
    "Integer": (32, True),
    "Enumeration": (32, True),  # wider in FMI 3.0, but no enumeration has that many items
    **{f"Int{bits}": (bits, True) for bits in (8, 16, 32, 64)},
    **{f"UInt{bits}": (bits, False) for bits in (8, 16, 32, 64)},
}


def convert_value(variable: Any, value: Any) -> Value:
    """Convert a value to its variable's type."""
    kind = variable.type
    if variable.dimensions:
        raise PlantError(f"{variable.name} is an array, expected a scalar: arrays cannot be set")
    is_number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    if kind in _REALS:
        if is_number and not math.isnan(value):
            return float(value)
        raise _type_error(variable, float(value) if is_number else value, "a number")
    if kind in _INTEGERS:
        if not (is_number and math.isfinite(value) and value == int(value)):
            raise _type_error(variable, value, "a whole number")
        bits, signed = _INTEGERS[kind]
        minimum, maximum = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else (0, 2**bits - 1)
        if not minimum <= value <= maximum:
            raise _type_error(variable, int(value), f"a whole number from {minimum} to {maximum}")
        return int(value)
    if kind == "Boolean":
        if isinstance(value, (bool, np.bool_)) or (is_number and value in (0, 1)):
            return bool(value)
        raise _type_error(variable, value, "true or false")
    if kind == "String":
        if isinstance(value, str):
            return value
        raise _type_error(variable, value, "a text")
    raise PlantError(f"{variable.name} is of type {kind}, which cannot be set")


def require_settable(variable: Any, initialized: bool) -> None:
    """Require that FMI allows to set a variable now."""
    if variable.causality == "input":
        return
    calculated = variable.initial == "calculated" or variable.causality in ("calculatedParameter", "independent")
    if calculated or variable.variability == "constant" or variable.causality == "structuralParameter":
        raise PlantError(f"{variable.name} cannot be set, expected a parameter, an input or a start value")
    if initialized and variable.variability != "tunable":
        raise PlantError(f"{variable.name} cannot be set any more: initialize() fixed it, until reset()")


def _type_error(variable: Any, value: object, expected: str) -> PlantError:
    unit = f" in {variable.unit}" if variable.unit else ""
    return PlantError(f"{variable.name} is {value!r}, expected {expected}{unit}")
