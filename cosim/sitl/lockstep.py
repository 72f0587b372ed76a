"""The autopilot's count of frames: what a packet means for the plant."""

from __future__ import annotations

from typing import Literal

Frame = Literal["first", "next", "resent", "gap", "restart"]


class Lockstep:
    """Follows the count of frames of one autopilot, which goes up by one with each answer that it has taken in.

    Attributes
    ----------
    count : int or None
        Of the last frame that made a step.
    missed : int
        Frames that were left out before the one judged last.
    """

    def __init__(self) -> None:
        self.count: int | None = None
        self.missed = 0

    def judge(self, count: int) -> Frame:
        """Say what a frame is, and follow it.

        Parameters
        ----------
        count : int
            Of the frame.

        Returns
        -------
        Frame
            ``"next"`` and ``"gap"`` ask for one step, ``"first"`` and ``"restart"`` for a new plant and one step, and
            ``"resent"`` for the last answer once more.
        """
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
