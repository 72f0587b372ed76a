"""A serial line, reopened after its device was removed and connected again."""

from __future__ import annotations

import contextlib
import logging
import os
import time
from functools import partial

from cosim.errors import TelemetryError
from cosim.mavlink.channels.stream import SinglePeer, Stream

log = logging.getLogger(__name__)

_RETRY_PERIOD = 1.0  # s, between two attempts to open
_QUEUE_SIZE = 1 << 13  # bytes in the queue; more would be outdated before they are sent


class Serial(SinglePeer):
    """A raw line of 8 bits, no parity, one stop bit, without flow control."""

    # It uses the calls of POSIX systems, so no package is needed; Windows is not supported.

    def __init__(self, path: str, baud: int) -> None:
        self._path, self._baud = path, baud
        self._attempted_at = time.monotonic()
        try:
            line = open_line(path, baud)
        except OSError as error:
            raise TelemetryError(f"serial:{path}: {error.strerror or error}") from error
        super().__init__(line, peer="device", slow="on a slow line")

    def poll(self, now: float) -> None:
        """Write queued frames, or try to reopen the device."""
        line = self._stream
        if line is not None:
            line.flush(now)  # a serial line is not closed for a stall
            if not line.is_open:
                log.warning("MAVLink: %s is gone", self._path)
                self._drop(line)
                self._attempted_at = now
        elif now - self._attempted_at > _RETRY_PERIOD:
            self._attempted_at = now
            with contextlib.suppress(OSError):
                self._stream = open_line(self._path, self._baud)
                log.warning("MAVLink: %s is back", self._path)


def open_line(path: str, baud: int) -> Stream:
    """Open a device."""
    speed = _baud_constant(path, baud)
    file = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        _configure_raw(file, speed)
    except OSError:
        os.close(file)
        raise
    return Stream(partial(os.read, file), partial(os.write, file), partial(os.close, file), _QUEUE_SIZE)


def _baud_constant(path: str, baud: int) -> int:
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


def _configure_raw(file: int, speed: int) -> None:
    """Set a terminal to raw mode, for exclusive use of this process."""
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
