"""The autopilot's frame count, by which packets are classified."""

from __future__ import annotations

from typing import Literal

Frame = Literal["first", "next", "resent", "gap", "restart"]


class Lockstep:
    """Tracks the frame count of one autopilot, which increases by one with each answer that it has received."""

    def __init__(self) -> None:
        self.count: int | None = None
        self.missed = 0

    def classify(self, count: int) -> Frame:
        """Classify a frame, and store its count."""
        last, self.count = self.count, count
        self.missed = 0
        if last is None:
            return "first"
        if count == last:
            return "resent"
        if count < last:
            return "restart"
        self.missed = count - last - 1
        return "gap" if self.missed else "next"
