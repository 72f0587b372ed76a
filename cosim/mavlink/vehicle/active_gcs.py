"""The active ground station: whose set-points and sticks apply, and whose silence triggers the failsafe."""

from __future__ import annotations

_KEEPS = 3.0  # s without commands, after which another system may take over
_KNOWN = 64  # systems whose heartbeats are kept


class ActiveGcs:
    """The system that steers: the first to send set-points or sticks keeps control until it is silent for 3 s.

    Attributes
    ----------
    commander : int or None
        System id of the last accepted command, whose loss triggers the failsafe.
    """

    def __init__(self) -> None:
        self.commander: int | None = None
        self._steering: tuple[int, float] | None = None
        self._beats: dict[int, float] = {}

    def may_steer(self, system: int, now: float) -> bool:
        """Return True if set-points or sticks of a system apply, and give it control if so.

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

    def record_command(self, system: int) -> None:
        """Record the system of an accepted command."""
        self.commander = system

    def record_heartbeat(self, system: int, now: float) -> None:
        """Record a heartbeat of a system."""
        if system not in self._beats and len(self._beats) >= _KNOWN:
            others = [known for known in self._beats if known != self.commander]
            del self._beats[min(others, key=lambda known: self._beats[known])]
        self._beats[system] = now

    def silence(self, now: float) -> float:
        """Return the time since the commanding system's last heartbeat [s]; 0 if it never sent one."""
        if self.commander is None or self.commander not in self._beats:
            return 0.0
        return now - self._beats[self.commander]
