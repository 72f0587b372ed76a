"""The active ground station: its set-points and sticks apply, and its silence triggers the failsafe."""

from __future__ import annotations

_CONTROL_TIMEOUT = 3.0  # s without commands, after which another system may take over
_MAX_SYSTEMS = 64  # systems whose heartbeats are stored


class ActiveGcs:
    """The system in control: the first to send set-points or sticks keeps control until it is silent for 3 s."""

    def __init__(self) -> None:
        self.commander: int | None = None
        self._controller: tuple[int, float] | None = None
        self._heartbeat_times: dict[int, float] = {}

    def request_control(self, system: int, now: float) -> bool:
        """Return True if set-points or sticks of a system apply, and give it control if so; now [s]."""
        if self._controller is not None:
            controller, last = self._controller
            if controller != system and now - last < _CONTROL_TIMEOUT:
                return False
        self._controller = (system, now)
        self.commander = system
        return True

    def record_command(self, system: int) -> None:
        """Record the system of an accepted command."""
        self.commander = system

    def record_heartbeat(self, system: int, now: float) -> None:
        """Record a heartbeat of a system."""
        if system not in self._heartbeat_times and len(self._heartbeat_times) >= _MAX_SYSTEMS:
            others = [other for other in self._heartbeat_times if other != self.commander]
            del self._heartbeat_times[min(others, key=self._heartbeat_times.__getitem__)]
        self._heartbeat_times[system] = now

    def silence(self, now: float) -> float:
        """Return the time since the commanding system's last heartbeat [s]; 0 if it never sent one."""
        if self.commander is None or self.commander not in self._heartbeat_times:
            return 0.0
        return now - self._heartbeat_times[self.commander]
