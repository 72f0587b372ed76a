"""What a live view is told: texts of JSON, and rows of numbers."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from cosim.helm.orders import Aim, Arm, Begin, Change, Face, Forget, Mission, Move, Obstacle, Order, Reset, Steer
from cosim.signals import Array


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


def words_of(order: Order) -> str | None:
    """Return what is ordered, in words; None for what comes all the time."""
    match order:
        case Arm():
            return "arm" if order.armed else "disarm"
        case Steer():
            return order.mode
        case Aim():
            sphere = f", a sphere of {order.radius:g} m" if order.radius is not None else ""
            return f"target to {_place(order.position)}{sphere}"
        case Face():
            return f"heading {np.degrees(order.heading):.0f}°"
        case Obstacle():
            return f"obstacle {order.number} of {order.radius:g} m at {_place(order.position)}"
        case Forget():
            return f"obstacle {order.number} gone"
        case Move():
            return f"{order.region} moved by {_place(order.by)}"
        case Change():
            return f"{order.key} = {order.value:g}"
        case Mission():
            return f"a mission of {len(order.items)} items"
        case Begin():
            return f"mission from item {order.item}"
        case Reset():
            return "reset"
    return None


def _place(place: tuple[float, float, float]) -> str:
    north, east, down = (f"{x:z.2f}".rstrip("0").rstrip(".") for x in place)
    return f"north {north}, east {east}, down {down} m"
