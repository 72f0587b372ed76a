"""A log of frames that ground stations replay."""

from __future__ import annotations

import contextlib
import logging
import os
import struct
import time
from collections import Counter
from collections.abc import Hashable

from cosim.errors import TelemetryError

log = logging.getLogger(__name__)

_FLUSHED = 1 << 16  # bytes that are written at once
_PERIOD = 1.0  # s of the wall clock, after which less is written too
_WAITING = 1 << 20  # bytes that wait at the most, for a disk that is full


class Tlog:
    """A new file of frames, each after its time: 8 bytes, big-endian, microseconds since 1970.

    Where none came, as for a run that could not begin, no file is left.

    The time is the wall clock at the start plus simulated time, so however fast the run was, it replays as it would
    have been lived. QGroundControl takes a time in the future for one of another byte order; hence `begin_earlier`.

    Attributes
    ----------
    simulated : float
        Time [s] of the frames to come, set by whoever sends them.

    Raises
    ------
    TelemetryError
        If the file exists or cannot be made.
    """

    datagrams = True

    def __init__(self, path: str) -> None:
        self.trouble: dict[str, int] = Counter()
        self.simulated = 0.0
        self._path = path
        self._start = time.time_ns() // 1000
        self._stamp = self._start & ~3
        self._waiting = bytearray()
        self._sent = False
        self._written = time.monotonic()
        try:
            self._file = open(path, "xb", buffering=0)  # noqa: SIM115 - open as long as the link is
        except OSError as error:
            raise TelemetryError(f"{path}: {error.strerror or error}") from error

    def begin_earlier(self, seconds: float) -> None:
        """Count from another time than the present one: by so much before it, before anything is sent."""
        self._start -= int(seconds * 1e6)
        self._stamp = self._start & ~3

    def receive(self) -> tuple[Hashable, bytes] | None:
        """Return nothing: a log is written only."""
        return None

    def heard(self, peer: Hashable, version: int) -> None:
        """Hear nothing."""

    def send(self, frame: bytes, old: bytes | None = None) -> bool:
        """Append a frame; return whether there was room for it."""
        if len(self._waiting) > _WAITING:
            self.trouble["frames not logged"] += 1
            return False
        elapsed = self.simulated * 1e6
        stamp = self._start + int(elapsed) if abs(elapsed) < 1e18 else self._stamp  # also where it is no number
        self._stamp = max(stamp & ~3, self._stamp)  # the lowest bits name a link
        self._waiting += struct.pack(">Q", self._stamp) + frame
        self._sent = True
        if len(self._waiting) > _FLUSHED:
            self._write()
        return True

    def tend(self, now: float) -> None:
        """Write what waits, now and then."""
        if now - self._written > _PERIOD:
            self._written = now
            self._write()

    def close(self) -> None:
        """Write what waits, and close the file."""
        self._write()
        if self._waiting:
            self.trouble["bytes not logged"] += len(self._waiting)
        self._file.close()
        if not self._sent:
            with contextlib.suppress(OSError):  # somebody took it away
                os.unlink(self._path)

    def _write(self) -> None:
        """Write what the disk takes; the rest waits, so no frame is torn should there be room again."""
        try:
            while self._waiting:
                del self._waiting[: self._file.write(self._waiting)]
        except OSError as error:
            if not self.trouble["failed writes"]:
                log.warning("MAVLink: %s: %s", self._path, error.strerror or error)
            self.trouble["failed writes"] += 1
