"""The course of a mission: which item is under way, and which one follows."""

from __future__ import annotations

import math
from collections.abc import Sequence

from cosim.errors import CommandError
from cosim.simulation.commands.commands import MissionItem


class MissionExecutor:
    """A mission under way.

    Attributes
    ----------
    items : tuple of MissionItem
        Of the mission.
    at : int
        The item under way, from 0; -1 before there is one.
    """

    def __init__(self) -> None:
        self.take(())

    def take(self, items: tuple[MissionItem, ...]) -> None:
        """Take another mission, which has not begun."""
        self.items, self.at = items, -1
        self._jumps: dict[int, int] = {}  # made so far, by item
        self._since = math.inf  # s, within the region of the present item

    def begin(self, item: int) -> None:
        """Go on with an item; all jumps can be made again.

        Raises
        ------
        CommandError
            If there is no such item.
        """
        if not 0 <= item < len(self.items):
            raise CommandError(f"item is {item}, expected 0 to {len(self.items) - 1}")
        self._jumps.clear()
        self.enter(item)

    def enter(self, item: int) -> MissionItem:
        """Let an item be under way, and return it."""
        self.at, self._since = item, math.inf
        return self.items[item]

    def region(self) -> MissionItem | None:
        """Return the item whose region counts: the present one, or the last one before it that has a place."""
        return next((item for item in self.items[self.at :: -1] if item.position is not None), None)

    def following(self, time: float, clearance: float) -> int | None:
        """Return the item that follows now, or None if the present one is not done, or is the last one.

        Parameters
        ----------
        time : float
            [s].
        clearance : float
            Of the region to be reached [m]; 0 or above within it. It does not count for an item without a place.
        """
        if not 0 <= self.at < len(self.items):
            return None
        item = self.items[self.at]
        within = item.position is None or clearance >= 0.0
        self._since = min(self._since, time) if within else math.inf
        if item.stay is None or not time - self._since >= item.stay:
            return None
        made = self._jumps.get(self.at, 0)
        if item.jump is not None and (item.times is None or made < item.times):
            self._jumps[self.at] = made + 1
            return item.jump
        return self.at + 1 if self.at + 1 < len(self.items) else None


def way(items: Sequence[MissionItem], before: int, now: int) -> list[int] | None:
    """Return the items that a mission went through from one to another that is under way now.

    Only those are gone through at once that have no place.

    Parameters
    ----------
    items : sequence of MissionItem
        Of the mission.
    before, now : int
        Items.

    Returns
    -------
    list of int or None
        `now` is the last of them; None, if `before` does not lead there by itself.
    """
    ways, seen = [[before + 1]], set[int]()
    while ways:
        path = ways.pop(0)
        item = path[-1]
        if item == now:
            return path
        if item in seen or not 0 <= item < len(items) or items[item].position is not None:
            continue
        seen.add(item)
        jump = items[item].jump
        ways += [[*path, following] for following in (item + 1, jump) if following is not None]
    return None
