"""The schedule of messages that one link streams."""

from __future__ import annotations

from collections.abc import Iterable

from cosim.mavlink.messages.message_table import Spec, message_specs
from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.mavlink.wire.link import Link

MIN_INTERVAL_US = 10_000
_MAX_INTERVAL_US = 3_600_000_000
MAX_LOAD = 250_000.0  # bytes per simulated second, of all streams of a link
_FRAME_OVERHEAD = 12  # bytes of header and checksum
_SECOND = 1_000_000


class Streams:
    """The schedule of a link, in whole microseconds of a monotonic clock, without drift; clock_us [µs]."""

    def __init__(self, context: VehicleContext, link: Link, clock_us: int) -> None:
        self._context, self._link, self._clock = context, link, clock_us
        self._specs = message_specs()
        self._intervals: dict[int, int] = {}
        self._due: dict[int, int] = {}
        self._earliest = clock_us
        self.heartbeat_sent = False
        for spec in self._specs.values():
            self._set_interval(spec.id, self._default_interval(spec))

    def _default_interval(self, spec: Spec) -> int:
        rate = spec.default_rate(self._context.options.profile)
        return round(_SECOND / rate) if rate > 0.0 else -1

    def _set_interval(self, message_id: int, interval_us: int) -> None:
        if interval_us < 0:
            self._intervals.pop(message_id, None)
            self._due.pop(message_id, None)
            return
        self._intervals[message_id] = interval_us
        self._due[message_id] = min(self._due.get(message_id, self._clock), self._clock + interval_us)
        self._earliest = min(self._earliest, self._due[message_id])

    def _load(self, spec: Spec, interval_us: int) -> float:
        size: int = (self._context.make.payload_sizes[spec.id] + _FRAME_OVERHEAD) * spec.count
        return size * _SECOND / interval_us

    @property
    def load(self) -> float:
        """Bytes sent per simulated second."""
        return sum(self._load(self._specs[i], interval) for i, interval in self._intervals.items())

    def interval(self, message_id: int) -> int:
        """Return the interval of a message [µs]: -1 if it is not streamed, 0 if there is no such message."""
        return self._intervals.get(message_id, -1) if message_id in self._specs else 0

    def set_intervals(self, changes: Iterable[tuple[int, int]]) -> bool:
        """Change intervals, all or none; changes [µs]."""
        new: dict[int, int] = {}
        for message_id, interval_us in changes:
            spec = self._specs.get(message_id)
            if spec is None:
                return False
            if interval_us == 0:
                new[message_id] = self._default_interval(spec)
            else:
                new[message_id] = -1 if interval_us < 0 else min(max(interval_us, MIN_INTERVAL_US), _MAX_INTERVAL_US)
        after = {**self._intervals, **new}
        load = sum(self._load(self._specs[i], interval) for i, interval in after.items() if interval > 0)
        if load > max(MAX_LOAD, self.load):
            return False
        for message_id, interval_us in new.items():
            self._set_interval(message_id, interval_us)
        return True

    def advance(self, clock_us: int) -> None:
        """Send each message that is due, once, even if several of its intervals have passed; clock_us [µs]."""
        self._clock = clock_us
        if clock_us < self._earliest:
            return
        for message_id, due in self._due.items():
            if due <= clock_us:
                self.send(message_id)
                interval = self._intervals[message_id]
                self._due[message_id] = due + ((clock_us - due) // interval + 1) * interval
        self._earliest = min(self._due.values(), default=clock_us + _SECOND)

    def send(self, message_id: int) -> None:
        """Send a message now."""
        for message in self._specs[message_id].build(self._context):
            self._link.send(message)
        self.heartbeat_sent |= self._specs[message_id].name == "HEARTBEAT"
