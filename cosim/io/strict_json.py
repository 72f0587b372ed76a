"""Strict JSON: NaN and infinity are written as null, since the format has no tokens for them."""

from __future__ import annotations

import contextlib
import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cosim.errors import RunError


def nan_to_none(value: Any) -> Any:
    """Replace NaN and infinity by None."""
    if isinstance(value, dict):
        return {key: nan_to_none(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [nan_to_none(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def json_text(value: Any) -> str:
    """Format a value as indented JSON."""
    return json.dumps(nan_to_none(value), indent=2, allow_nan=False) + "\n"


@contextlib.contextmanager
def understood(file: Path) -> Iterator[None]:
    """Convert errors of the block that missing keys or wrong types in a JSON file cause to a RunError."""
    try:
        yield
    except (KeyError, TypeError, ValueError, AttributeError, IndexError, OverflowError) as error:
        raise RunError(f"{file}: cannot be understood: {error!r}") from error


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON file that holds an object."""
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise RunError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (ValueError, RecursionError) as error:
        raise RunError(f"{path}: cannot be read: {error}") from error
    if not isinstance(table, dict):
        raise RunError(f"{path}: cannot be read: it holds no table")
    return table
