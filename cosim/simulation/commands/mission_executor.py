"""Execution of a mission: the present item, and the one that follows."""

from __future__ import annotations

import math
from collections.abc import Sequence

from cosim.errors import CommandError
from cosim.simulation.commands.commands import MissionItem


class MissionExecutor:
    """Executes the items of a mission."""

    def __init__(self) -> None:
        self.set_items(())

    def set_items(self, items: tuple[MissionItem, ...]) -> None:
        """Replace the mission; the new one has not begun."""
        self.items, self.at = items, -1
        self._jumps: dict[int, int] = {}  # number of jumps made, by item
        self._since = math.inf  # s, time since which the vehicle is within the region of the present item

    def begin(self, item: int) -> None:
        """Continue with an item, and reset the counts of jumps."""
        if not 0 <= item < len(self.items):
            raise CommandError(f"item is {item}, expected 0 to {len(self.items) - 1}")
        self._jumps.clear()
        self.enter(item)

    def enter(self, item: int) -> MissionItem:
        """Make an item the present one, and return it."""
        self.at, self._since = item, math.inf
        return self.items[item]

    def region(self) -> MissionItem | None:
        """Return the item whose region is the target: the present one, or the last before it with a position."""
        return next((item for item in self.items[self.at :: -1] if item.position is not None), None)

    def following(self, time: float, clearance: float) -> int | None:
        """Return the index of the next item; None while the present one is not done, or if it is the last one."""
        # Units of arguments: time [s]; clearance [m]
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


def passed_items(items: Sequence[MissionItem], before: int, now: int) -> list[int] | None:
    """Return the items that a mission passed through from one item to the present one."""
    # Only items without a position are passed through at once.
    ways, visited = [[before + 1]], set[int]()
    while ways:
        path = ways.pop(0)
        item = path[-1]
        if item == now:
            return path
        if item in visited or not 0 <= item < len(items) or items[item].position is not None:
            continue
        visited.add(item)
        jump = items[item].jump
        ways += [[*path, following] for following in (item + 1, jump) if following is not None]
    return None
