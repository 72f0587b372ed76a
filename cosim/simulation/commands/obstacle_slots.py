"""Slots for the obstacles that commands add during a run."""

from __future__ import annotations

from cosim.errors import CommandError


class ObstacleSlots:
    """Slots for obstacles, of which the lowest free one is assigned next."""

    def __init__(self, count: int) -> None:
        self._taken: dict[int, int] = {}  # slot of each obstacle by its number
        self._free = list(range(count))

    def assign(self, number: int) -> int:
        """Return the slot of an obstacle, from 0; assign a free one if it has none yet."""
        if number not in self._taken:
            if not self._free:
                raise CommandError(f"no room for obstacle {number}: {len(self._taken)} have come already")
            self._taken[number] = self._free.pop(0)
        return self._taken[number]

    def release(self, number: int) -> int | None:
        """Free the slot of an obstacle and return it; None if it has none."""
        slot = self._taken.pop(number, None)
        if slot is not None:
            self._free = sorted([*self._free, slot])
        return slot
