"""Messages to viewers: texts of JSON, and rows of numbers."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from cosim.simulation.signals import Array


def format_message(kind: str, /, **fields: Any) -> str:
    """Format a JSON message; its first key ``type`` is `kind`."""
    return json.dumps({"type": kind, **fields}, separators=(",", ":"), allow_nan=False, ensure_ascii=False)


def write_rows(rows: Array) -> bytes:
    """Serialize rows in order as little-endian float64."""
    return np.ascontiguousarray(rows, dtype="<f8").tobytes()


def read_rows(message: bytes, columns: int) -> Array:
    """Parse the rows of a message, shape (rows, columns)."""
    rows: Array = np.frombuffer(message, dtype="<f8").reshape(-1, columns)
    return rows
