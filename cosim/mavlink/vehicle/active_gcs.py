"""Whose set-points and sticks count, and whose silence matters."""

from __future__ import annotations

_KEEPS = 3.0  # s of silence, after which another system may take over
_KNOWN = 64  # systems whose heartbeats are remembered


class ActiveGcs:
    """Who has the vehicle in hand: the first that comes keeps it until it is silent.

    Attributes
    ----------
    commander : int or None
        System id whose command was heeded last: the one whose loss matters.
    """

    def __init__(self) -> None:
        self.commander: int | None = None
        self._steering: tuple[int, float] | None = None
        self._beats: dict[int, float] = {}

    def may_steer(self, system: int, now: float) -> bool:
        """Return whether set-points or sticks of a system count, and keep the vehicle for it if so.

        Parameters
        ----------
        system : int
            System id.
        now : float
            The wall clock [s].
        """
        if self._steering is not None:
            who, last = self._steering
            if who != system and now - last < _KEEPS:
                return False
        self._steering = (system, now)
        self.commander = system
        return True

    def commanded(self, system: int) -> None:
        """Note that a command of a system was heeded."""
        self.commander = system

    def beat(self, system: int, now: float) -> None:
        """Note a heartbeat of a system."""
        if system not in self._beats and len(self._beats) >= _KNOWN:
            others = [known for known in self._beats if known != self.commander]
            del self._beats[min(others, key=lambda known: self._beats[known])]
        self._beats[system] = now

    def silence(self, now: float) -> float:
        """Return for how long the commanding system has sent no heartbeat [s]; 0 if it never sent one."""
        if self.commander is None or self.commander not in self._beats:
            return 0.0
        return now - self._beats[self.commander]
