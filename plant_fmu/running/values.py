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


def convert_value(variable: Any, value: object) -> Value:
    """Convert a value to its variable's type."""
    kind = variable.type
    if variable.dimensions:
        raise PlantError(f"{variable.name} is an array, expected a scalar: arrays cannot be set")
    if kind in _REALS:
        return _real(variable, value)
    if kind in _INTEGERS:
        return _integer(variable, value, *_INTEGERS[kind])
    if kind == "Boolean":
        if isinstance(value, (bool, np.bool_)) or (_is_number(value) and value in (0, 1)):
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


def _real(variable: Any, value: object) -> float:
    if not _is_number(value):
        raise _type_error(variable, value, "a number")
    number = float(value)  # type: ignore[arg-type]
    if math.isnan(number):
        raise _type_error(variable, number, "a number")
    return number


def _integer(variable: Any, value: object, bits: int, signed: bool) -> int:
    if not _is_number(value) or not math.isfinite(value) or value != int(value):  # type: ignore[arg-type, call-overload]
        raise _type_error(variable, value, "a whole number")
    number = int(value)  # type: ignore[call-overload]
    minimum, maximum = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else (0, 2**bits - 1)
    if not minimum <= number <= maximum:
        raise _type_error(variable, number, f"a whole number from {minimum} to {maximum}")
    return int(number)


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)


def _type_error(variable: Any, value: object, expected: str) -> PlantError:
    unit = f" in {variable.unit}" if variable.unit else ""
    return PlantError(f"{variable.name} is {value!r}, expected {expected}{unit}")
