"""JSON that any reader takes: what is no number is null, since the format has no word for it."""

from __future__ import annotations

import contextlib
import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cosim.errors import RunError


def nan_to_none(value: Any) -> Any:
    """Return a value with None for each number that is none.

    Parameters
    ----------
    value : Any
        Of texts, numbers, booleans, lists, tuples and dicts.

    Returns
    -------
    Any
        The same, tuples as lists.
    """
    if isinstance(value, dict):
        return {key: nan_to_none(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [nan_to_none(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def json_text(value: Any) -> str:
    """Return a value as JSON for people and programs, indented.

    Parameters
    ----------
    value : Any
        As for `nan_to_none`.

    Returns
    -------
    str
        With null for each number that is none, and a newline at its end.
    """
    return json.dumps(nan_to_none(value), indent=2, allow_nan=False) + "\n"


@contextlib.contextmanager
def understood(file: Path) -> Iterator[None]:
    """Refuse a file of JSON in whose table something is not as it is looked for within the block.

    Parameters
    ----------
    file : Path
        For the message.

    Raises
    ------
    RunError
        In the place of what a key that is missing, or a value of another type, brings about.
    """
    try:
        yield
    except (KeyError, TypeError, ValueError, AttributeError, IndexError, OverflowError) as error:
        raise RunError(f"{file}: cannot be understood: {error!r}") from error


def read_json(path: Path) -> dict[str, Any]:
    """Return a table that was written as JSON.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    dict
        As it was written.

    Raises
    ------
    RunError
        If it cannot be read, or holds something else.
    """
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise RunError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (ValueError, RecursionError) as error:
        raise RunError(f"{path}: cannot be read: {error}") from error
    if not isinstance(table, dict):
        raise RunError(f"{path}: cannot be read: it holds no table")
    return table
