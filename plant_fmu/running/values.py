"""Check values against the type of their variable before an FMU receives them."""

from __future__ import annotations

import contextlib
import math
from typing import Any

import numpy as np

from plant_fmu.errors import PlantError
from plant_fmu.model_variables import ModelVariable
from plant_fmu.running.channels import DOUBLES

Value = float | int | bool | str

_ROUNDING = 1e-9  # how far outside of its range a value may be, relative to the bound unless that is 0
_REALS = (*DOUBLES, "Float32")
_INTEGERS = {  # number of bits of each type of whole numbers, and True if signed
    "Integer": (32, True),
    "Enumeration": (32, True),  # wider in FMI 3.0, but no enumeration has that many items
    **{f"Int{bits}": (bits, True) for bits in (8, 16, 32, 64)},
    **{f"UInt{bits}": (bits, False) for bits in (8, 16, 32, 64)},
}


def convert_values(variable: ModelVariable, value: Any) -> list[Value]:
    """Convert a value to its variable's type: to one, or to the items of an array row by row."""
    shape = variable.shape
    if not shape:
        return [convert_value(variable, value)]
    if np.shape(value) != shape:
        raise PlantError(f"{variable.name} has shape {np.shape(value)}, expected {shape}")
    return [convert_value(variable, item) for item in np.asarray(value).ravel().tolist()]


def convert_value(variable: ModelVariable, value: Any) -> Value:
    """Convert one value to its variable's type; a number that exceeds its range by rounding is clipped."""
    kind = variable.type
    is_number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    if kind in _REALS:
        if is_number and not math.isnan(value):
            return _clip(variable, float(value))
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


def _clip(variable: ModelVariable, value: float) -> float:
    for bound, sign in ((variable.minimum, -1.0), (variable.maximum, 1.0)):
        with contextlib.suppress(ValueError):  # there is none, or it is no number
            number = float(bound)
            if 0.0 < sign * (value - number) <= _ROUNDING * (abs(number) or 1.0):
                return number
    return value


def require_settable(variable: ModelVariable, initialized: bool) -> None:
    """Require that FMI allows to set a variable now."""
    if variable.causality == "input":
        return
    calculated = variable.initial == "calculated" or variable.causality in ("calculatedParameter", "independent")
    if calculated or variable.variability == "constant" or variable.causality == "structuralParameter":
        raise PlantError(f"{variable.name} cannot be set, expected a parameter, an input or a start value")
    if initialized and variable.variability != "tunable":
        raise PlantError(f"{variable.name} cannot be set any more: initialize() fixed it, until reset()")


def _type_error(variable: ModelVariable, value: object, expected: str) -> PlantError:
    unit = f" in {variable.unit}" if variable.unit else ""
    return PlantError(f"{variable.name} is {value!r}, expected {expected}{unit}")
