"""Which of the places for obstacles that come while a run goes on each of them has."""

from __future__ import annotations

from cosim.errors import CommandError


class ObstacleSlots:
    """Places for obstacles, given out by the lowest free one.

    Parameters
    ----------
    count : int
        How many there are.
    """

    def __init__(self, count: int) -> None:
        self._taken: dict[int, int] = {}  # by the number of the obstacle
        self._free = list(range(count))

    def take(self, number: int) -> int:
        """Return the place of an obstacle, from 0; a free one, if it has none yet.

        Raises
        ------
        CommandError
            If there is none.
        """
        if number not in self._taken:
            if not self._free:
                raise CommandError(f"no room for obstacle {number}: {len(self._taken)} have come already")
            self._taken[number] = self._free.pop(0)
        return self._taken[number]

    def leave(self, number: int) -> int | None:
        """Return the place that an obstacle gives up, None if it has none."""
        slot = self._taken.pop(number, None)
        if slot is not None:
            self._free = sorted([*self._free, slot])
        return slot
