"""JSON that any reader takes: what is no number is null, since the format has no word for it."""

from __future__ import annotations

import json
import math
from typing import Any


def plain(value: Any) -> Any:
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
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def json_text(value: Any) -> str:
    """Return a value as JSON for people and programs, indented.

    Parameters
    ----------
    value : Any
        As for `plain`.

    Returns
    -------
    str
        With null for each number that is none, and a newline at its end.
    """
    return json.dumps(plain(value), indent=2, allow_nan=False) + "\n"
