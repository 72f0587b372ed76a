"""What a live view is told: texts of JSON, and rows of numbers."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from cosim.simulation.signals import Array


def text_of(kind: str, /, **fields: Any) -> str:
    """Return a message of a kind; ``type`` is its first key."""
    return json.dumps({"type": kind, **fields}, separators=(",", ":"), allow_nan=False, ensure_ascii=False)


def bytes_of(rows: Array) -> bytes:
    """Return rows one behind the other, as little-endian float64."""
    return np.ascontiguousarray(rows, dtype="<f8").tobytes()


def rows_of(message: bytes, columns: int) -> Array:
    """Return the rows of a message, shape (rows, columns).

    Raises
    ------
    ValueError
        If they are not whole.
    """
    rows: Array = np.frombuffer(message, dtype="<f8").reshape(-1, columns)
    return rows
