"""A serial line, opened anew when its device was pulled out and is back."""

from __future__ import annotations

import contextlib
import logging
import os
import time
from collections import Counter
from collections.abc import Hashable

from cosim.errors import TelemetryError
from cosim.mavlink.channels.channel import CHUNK
from cosim.mavlink.channels.stream import Outgoing

log = logging.getLogger(__name__)

_AGAIN = 1.0  # s, between two attempts to open
_WAITING = 1 << 13  # bytes: more than that is stale before it is sent


class Serial:
    """A raw line of 8 bits, no parity, one stop bit, without flow control.

    The operating system's own calls do all of it, so nothing needs to be installed; Windows has other ones.

    Parameters
    ----------
    path : str
        Of the device.
    baud : int
        Bits a second, one of those that the system knows.

    Raises
    ------
    TelemetryError
        If it cannot be opened.
    """

    datagrams = False

    def __init__(self, path: str, baud: int) -> None:
        self.trouble: dict[str, int] = Counter()
        self._path, self._baud = path, baud
        self._last = time.monotonic()
        try:
            self._line: Line | None = Line(path, baud)
        except OSError as error:
            raise TelemetryError(f"serial:{path}: {error.strerror or error}") from error

    def receive(self) -> tuple[Hashable, bytes] | None:
        """Return bytes of the line."""
        line = self._line
        data = None if line is None else line.read()
        return None if data is None else (line, data)

    def heard(self, peer: Hashable) -> None:
        """Know the peer already."""

    def send(self, frame: bytes) -> bool:
        """Write to the line, if it is there."""
        if self._line is None:
            self.trouble["frames dropped while there was no device"] += 1
            return False
        return self._line.put(frame)

    def tend(self, now: float) -> None:
        """Write what waits, or try to open the device again."""
        line = self._line
        if line is not None:
            line.flush(now)
            if not line.open:
                log.warning("MAVLink: %s is gone", self._path)
                self._lose(line)
                self._last = now
        elif now - self._last > _AGAIN:
            self._last = now
            with contextlib.suppress(OSError):
                self._line = Line(self._path, self._baud)
                log.warning("MAVLink: %s is back", self._path)

    def close(self) -> None:
        """Close the device."""
        if self._line is not None:
            self._line.flush(0.0)
            self._lose(self._line)

    def _lose(self, line: Line) -> None:
        if line.outgoing.dropped:
            self.trouble["frames dropped on a slow line"] += line.outgoing.dropped
        line.close()
        self._line = None


class Line:
    """An open device.

    Raises
    ------
    OSError
        If it cannot be opened.
    TelemetryError
        If the baud rate is none that the system knows, or this is Windows.
    """

    def __init__(self, path: str, baud: int) -> None:
        speed = _speed(path, baud)
        self._file = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            _make_raw(self._file, speed)
        except OSError:
            os.close(self._file)
            raise
        self.outgoing = Outgoing(lambda data: os.write(self._file, data), _WAITING)
        self.open = True

    def read(self) -> bytes | None:
        """Return what has come, None if nothing has; `open` tells whether more can come."""
        try:
            data = os.read(self._file, CHUNK)
        except (BlockingIOError, InterruptedError):
            return None
        except OSError:
            data = b""
        self.open = bool(data)
        return data or None

    def put(self, frame: bytes) -> bool:
        """Take a frame; return whether there was room."""
        try:
            return self.outgoing.put(frame)
        except OSError:
            self.open = False
            return False

    def flush(self, now: float) -> None:
        """Write what waits; that the line takes nothing for long is no fault of it."""
        try:
            self.outgoing.flush(now)
        except OSError:
            self.open = False

    def close(self) -> None:
        """Close the device."""
        self.open = False
        os.close(self._file)


def _speed(path: str, baud: int) -> int:
    try:
        import termios
    except ImportError as error:
        raise TelemetryError(f"serial:{path}: serial lines need Linux or macOS") from error
    known = {name[1:]: value for name, value in vars(termios).items() if name[0] == "B" and name[1:].isdecimal()}
    speed = known.get(str(baud))
    if not isinstance(speed, int) or not baud:
        rates = ", ".join(sorted(known, key=int)[-12:])
        raise TelemetryError(f"serial:{path}: baud is {baud}, expected one that the system knows, such as {rates}")
    return speed


def _make_raw(file: int, speed: int) -> None:
    """Set a terminal to pass all bytes as they are, for this process alone."""
    import fcntl
    import termios
    import tty

    try:
        tty.setraw(file, termios.TCSANOW)
        settings = termios.tcgetattr(file)
        settings[2] = (settings[2] | termios.CLOCAL | termios.CREAD) & ~(termios.CRTSCTS | termios.CSTOPB)
        settings[4] = settings[5] = speed
        termios.tcsetattr(file, termios.TCSANOW, settings)
        fcntl.ioctl(file, termios.TIOCEXCL)
    except termios.error as error:
        raise OSError(*error.args) from error
