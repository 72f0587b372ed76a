"""Types of flags that take numbers within bounds."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable

_SHOWN = 40  # greatest number of characters of a refused text in the message


def whole(low: int, high: int) -> Callable[[str], int]:
    """Make the type of a flag that takes a whole number."""

    def parse(text: str) -> int:
        digits = text.isascii() and text.isdecimal() and len(text) <= len(str(high))
        if digits and low <= int(text) <= high:
            return int(text)
        raise argparse.ArgumentTypeError(f"{text[:_SHOWN]!r}: expected a whole number from {low} to {high}")

    return parse


def number(low: float, high: float) -> Callable[[str], float]:
    """Make the type of a flag that takes a number."""

    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if low <= value <= high:
            return value
        raise argparse.ArgumentTypeError(f"{text[:_SHOWN]!r}: expected a number from {low:g} to {high:g}")

    return parse


def rate(text: str) -> float:
    """Parse a rate in simulated seconds per second; ``max`` is infinity."""
    try:
        return math.inf if text == "max" else number(1e-3, 1e6)(text)
    except argparse.ArgumentTypeError as error:
        raise argparse.ArgumentTypeError(f"{error}, or max") from None
