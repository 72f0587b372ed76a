"""A telemetry log (.tlog), which ground stations replay."""

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

_WRITE_THRESHOLD = 1 << 16  # bytes in the buffer above which they are written
_WRITE_PERIOD = 1.0  # s of the wall clock between writes of a shorter buffer
_BUFFER_SIZE = 1 << 20  # bytes, limit while the disk is full


class Tlog:
    """A new file of frames, each after its time: 8 bytes, big-endian, microseconds since 1970."""

    # Without any frame, as for a run that could not start, the file is removed.
    #
    # The time is the wall clock at the start plus simulated time, so a run of any speed replays in real time.
    # QGroundControl reads a time in the future with the other byte order; hence `advance_start`.

    datagrams = True

    def __init__(self, path: str) -> None:
        self.losses: dict[str, int] = Counter()
        self.simulated = 0.0  # simulated time [s] of the next frames, set by the sender
        self._path = path
        self._start = time.time_ns() // 1000
        self._stamp = self._start & ~3
        self._buffer = bytearray()
        self._has_frames = False
        self._written_at = time.monotonic()
        try:
            self._file = open(path, "xb", buffering=0)  # noqa: SIM115 - open as long as the link is
        except OSError as error:
            raise TelemetryError(f"{path}: {error.strerror or error}") from error

    def advance_start(self, seconds: float) -> None:
        """Set the start time earlier by `seconds`; call it before the first frame."""
        self._start -= int(seconds * 1e6)
        self._stamp = self._start & ~3

    def receive(self) -> tuple[Hashable, bytes] | None:
        """Return None: a log is only written."""
        return None

    def record_version(self, peer: Hashable, version: int) -> None:
        """Do nothing: a log has no peers."""

    def send(self, frame: bytes, frame_v1: bytes | None = None) -> bool:
        """Append a frame; return False if the buffer is full."""
        if len(self._buffer) > _BUFFER_SIZE:
            self.losses["frames not logged"] += 1
            return False
        elapsed = self.simulated * 1e6
        stamp = self._start + int(elapsed) if abs(elapsed) < 1e18 else self._stamp  # the last one if it is NaN
        self._stamp = max(stamp & ~3, self._stamp)  # the lowest bits name a link
        self._buffer += struct.pack(">Q", self._stamp) + frame
        self._has_frames = True
        if len(self._buffer) > _WRITE_THRESHOLD:
            self._write()
        return True

    def poll(self, now: float) -> None:
        """Write the buffer once a second."""
        if now - self._written_at > _WRITE_PERIOD:
            self._written_at = now
            self._write()

    def close(self) -> None:
        """Write the buffer, and close the file."""
        self._write()
        if self._buffer:
            self.losses["bytes not logged"] += len(self._buffer)
        self._file.close()
        if not self._has_frames:
            with contextlib.suppress(OSError):  # it was removed already
                os.unlink(self._path)

    def _write(self) -> None:
        """Write as much as the disk accepts; keep the rest, so that no frame is lost in part."""
        try:
            while self._buffer:
                del self._buffer[: self._file.write(self._buffer)]
        except OSError as error:
            if not self.losses["failed writes"]:
                log.warning("MAVLink: %s: %s", self._path, error.strerror or error)
            self.losses["failed writes"] += 1
