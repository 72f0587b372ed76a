"""What a definition is made of: checked, so that whatever else comes is refused in one line."""

from __future__ import annotations

import math
from collections.abc import Iterable
from numbers import Real
from typing import TypeVar

from fuzzy_arbiter.errors import DefinitionError

_T = TypeVar("_T")

MAX_NAME = 200  # characters


def finite(value: object) -> float | None:
    """Return a number as a float.

    Parameters
    ----------
    value : object
        Anything.

    Returns
    -------
    float or None
        None for what is no real number or not finite; a truth value is no number here, nor is a text.
    """
    try:
        x = float(value) if isinstance(value, Real) and not isinstance(value, bool) else math.nan
    except OverflowError:
        return None
    return x + 0.0 if math.isfinite(x) else None  # without the sign of zero, so that what is equal looks equal


def all_of(kind: type[_T] | tuple[type[_T], ...], values: object, where: object, expected: str) -> tuple[_T, ...]:
    """Return the members of a sequence or of anything else that can be gone through.

    Parameters
    ----------
    kind : type or tuple of type
        What each must be.
    values : object
        What came.
    where : object
        What it is, of which the fault says the text.
    expected : str
        What was expected, for the fault.

    Returns
    -------
    tuple
        The members in their order.

    Raises
    ------
    DefinitionError
        If it has no members, or one is of another kind.
    """
    if isinstance(values, str) or not isinstance(values, Iterable):
        raise DefinitionError(f"{where}: {shown(values)} came, expected {expected}")
    members = tuple(values)
    for member in members:
        if not isinstance(member, kind):
            raise DefinitionError(f"{where}: {shown(member)} came among them, expected {expected}")
    return members


def require_name(name: object, what: str) -> None:
    """Refuse what cannot be a name.

    Parameters
    ----------
    name : object
        What came.
    what : str
        Whose name it is.

    Raises
    ------
    DefinitionError
        Unless it is printable text, not absurdly long, without double quotes or outer spaces.
    """
    if isinstance(name, str) and len(name) > MAX_NAME:
        raise DefinitionError(f"{what} name is {shown(name)}, expected at most {MAX_NAME} characters")
    if not isinstance(name, str) or not name or name != name.strip() or not name.isprintable() or '"' in name:
        raise DefinitionError(
            f"{what} name is {shown(name)}, expected printable text without double quotes or outer spaces"
        )


def shown(value: object) -> str:
    """Return what came as a fault quotes it.

    Parameters
    ----------
    value : object
        Anything.

    Returns
    -------
    str
        Its representation on one line, cut if it is long.
    """
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # a whole number of more digits than Python writes
        text = f"a {type(value).__name__} that is too long to show"
    return text if len(text) <= 100 else f"{text[:100]}..."
