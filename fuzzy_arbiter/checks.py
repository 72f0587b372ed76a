"""Validate the parts of a definition; refuse each invalid one in one line."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from numbers import Real
from typing import TypeVar

from fuzzy_arbiter.errors import DefinitionError

_T = TypeVar("_T")

MAX_NAME = 200  # maximum number of characters of a name


def finite(value: object) -> float | None:
    """Return a number as a float."""
    try:
        x = float(value) if isinstance(value, Real) and not isinstance(value, bool) else math.nan
    except OverflowError:
        return None
    return x + 0.0 if math.isfinite(x) else None  # -0.0 becomes 0.0, so that equal values have equal texts


def finite_numbers(values: Iterable[object]) -> tuple[float, ...] | None:
    """Return numbers as floats; None if one of them is not finite."""
    numbers = tuple(map(finite, values))
    return None if None in numbers else numbers  # type: ignore[return-value]


def all_of(kind: type[_T] | tuple[type[_T], ...], values: object, where: object, expected: str) -> tuple[_T, ...]:
    """Return the members of an iterable as a tuple, and check the type of each."""
    if isinstance(values, str) or not isinstance(values, Iterable):
        raise DefinitionError(f"{where}: got {shown(values)}, expected {expected}")
    members = tuple(values)
    for member in members:
        if not isinstance(member, kind):
            raise DefinitionError(f"{where}: got {shown(member)} among them, expected {expected}")
    return members


def require_choice(value: object, known: Iterable[str], what: str) -> None:
    """Require that a value is one of some words."""
    if not isinstance(value, str) or value not in (known := tuple(known)):
        raise DefinitionError(f"{what} is {shown(value)}, expected one of {', '.join(known)}")


def require_distinct(names: Iterable[str], what: str) -> None:
    """Require that each name occurs once."""
    for name, count in Counter(names).items():
        if count > 1:
            raise DefinitionError(f"{what} are named {name!r}, expected each name once")


def require_name(name: object, what: str) -> None:
    """Require that a value is a valid name."""
    if isinstance(name, str) and len(name) > MAX_NAME:
        raise DefinitionError(f"{what} name is {shown(name)}, expected at most {MAX_NAME} characters")
    if not isinstance(name, str) or not name or name != name.strip() or not name.isprintable() or '"' in name:
        raise DefinitionError(
            f"{what} name is {shown(name)}, expected printable text without double quotes or outer spaces"
        )


def shown(value: object) -> str:
    """Format a value for an error message."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # a whole number of more digits than Python writes
        text = f"a {type(value).__name__} that is too long to show"
    return text if len(text) <= 100 else f"{text[:100]}..."
