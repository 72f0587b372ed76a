"""Signatures of frames: frames without a valid signature, and repeated ones, are rejected."""

from __future__ import annotations

import hashlib
import hmac
import logging
import os
import time
from pathlib import Path
from typing import Final, Literal

import platformdirs

from cosim.errors import TelemetryError
from cosim.io.atomic_file import write_atomic

log = logging.getLogger(__name__)

KEY_BYTES = 32
_MAX_KEY_FILE = 4096  # bytes
MAX_STREAMS = 64  # number of senders whose last timestamps are kept
_EPOCH = 1_420_070_400  # s, 2015-01-01 in Unix time, the epoch of MAVLink's timestamps
_PER_SECOND = 100_000  # timestamps count 10 us
_MINUTE = 60 * _PER_SECOND
_WRITE_AHEAD = 2 * _PER_SECOND  # by which the saved timestamp is ahead of the clock, so that it is seldom written
_MIN_WRITE_AHEAD = _PER_SECOND // 4  # by which it is ahead of the last one at least: a peer's clock may be ahead
_REMEDY = "remove the file, after which earlier frames are accepted again"
_MAX_TIMESTAMP = (1 << 48) - 1
Rejection = Literal["unsigned", "forged", "replayed", "old", "ahead", "crowded"]  # names in `RxStats`
_SIGNATURE_SIZE, _STAMP_SIZE, _HASH_SIZE = 13, 6, 6  # bytes of a signature, its timestamp, its hash


def load_key(path: Path) -> bytes:
    """Load the signing key from a file."""
    # 32 bytes that are not text, or 64 hexadecimal digits, are the key itself. Any other text is a passphrase, and its
    # SHA-256 is the key, as in MAVProxy, QGroundControl and Mission Planner; white space around it is ignored.
    try:
        with path.open("rb") as file:
            mode = os.fstat(file.fileno()).st_mode
            content = file.read(_MAX_KEY_FILE + 1)
    except OSError as error:
        raise TelemetryError(f"{path}: the key cannot be read: {error.strerror or error}") from error
    if os.name == "posix" and mode & 0o077:
        raise TelemetryError(f"{path}: mode is {mode & 0o777:o}, expected 600: its readers can command the vehicle")
    if len(content) > _MAX_KEY_FILE:
        raise TelemetryError(f"{path}: more than {_MAX_KEY_FILE} bytes, expected a key or a passphrase")
    try:
        text = content.decode().strip()
    except UnicodeDecodeError:
        text = None
    if text is not None and text.isprintable() and text:
        return bytes.fromhex(text) if _is_hexadecimal(text) else hashlib.sha256(text.encode()).digest()
    if len(content) == KEY_BYTES:
        return content
    raise TelemetryError(
        f"{path}: {len(content)} bytes that are not text, "
        f"expected {KEY_BYTES} bytes, {2 * KEY_BYTES} hexadecimal digits or a passphrase"
    )


def _is_hexadecimal(text: str) -> bool:
    return len(text) == 2 * KEY_BYTES and all(c in "0123456789abcdefABCDEF" for c in text)


def timestamp_file(key: bytes, identity: tuple[int, int]) -> Path:
    """Return the file in the user's state folder that keeps the last timestamp of a key and an identity."""
    # Its name shows nothing of the key.
    name = hmac.new(key, b"timestamps", hashlib.sha256).hexdigest()[:16]
    return platformdirs.user_state_path("subreach") / "signing" / "{}-{}-{}".format(name, *identity)


class SigningClock:
    """Strictly increasing timestamps of all signed frames of this vehicle, also across restarts."""

    # They follow the wall clock, or the latest verified timestamp of a peer, at most a minute ahead: a peer whose clock
    # is ahead would refuse earlier ones as old. The file is written ahead of the timestamps, every two seconds.

    def __init__(self, file: Path | None = None) -> None:
        self._file = file
        self._offset = time.time() - time.monotonic()  # s: guards against a wall clock that is set back
        # timestamp of the file at the start [10 us since 2015]; frames up to it may be those of an earlier process
        self.floor = self._last = self._saved = 0
        if file is None:
            return
        try:
            file.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
            self.floor = self._last = _load_timestamp(file)
            if self.floor > self.latest_accepted + _WRITE_AHEAD:
                ahead = (self.floor - self.latest_accepted + _MINUTE) / _PER_SECOND
                raise TelemetryError(f"{file}: is {ahead:.0f} s ahead of the clock; set the clock, or {_REMEDY}")
            self._save(file)
        except OSError as error:
            raise TelemetryError(f"{file}: timestamps cannot be saved: {error.strerror or error}") from error

    @property
    def latest_accepted(self) -> int:
        """Latest accepted timestamp [10 us since 2015]: a minute after the wall clock."""
        wall = max(time.time(), self._offset + time.monotonic())
        return int((wall - _EPOCH) * _PER_SECOND) + _MINUTE

    @property
    def now(self) -> int:
        """Time [10 us since 2015], at least that of the latest frame."""
        return max(self._last, int((time.time() - _EPOCH) * _PER_SECOND))

    def next(self) -> int:
        """Return the timestamp of the next frame."""
        self.advance_to(min(max(self._last + 1, self.now), _MAX_TIMESTAMP))
        return self._last

    def advance_to(self, stamp: int) -> None:
        """Advance to a timestamp with a valid signature, or of a frame to be sent."""
        self._last = max(self._last, stamp)
        if self._file is not None and self._last > self._saved:
            try:
                self._save(self._file)
            except (OSError, TelemetryError) as error:  # the link goes on
                log.warning("%s: after a restart, today's frames can be replayed: %s", self._file, error)
                self._file = None

    def _save(self, file: Path) -> None:
        """Write a timestamp ahead of the last one and the clock, unless another process has written a later one."""
        self._saved = min(
            max(self._last + _MIN_WRITE_AHEAD, self.latest_accepted - _MINUTE + _WRITE_AHEAD), _MAX_TIMESTAMP
        )
        write_atomic(file, f"{max(self._saved, _load_timestamp(file))}\n")


def _load_timestamp(file: Path) -> int:
    """Return the timestamp of a file, 0 if there is no file."""
    try:
        with file.open("rb") as content:
            text = content.read(20).strip()
    except FileNotFoundError:
        return 0
    if not text.isdigit() or int(text) > _MAX_TIMESTAMP:
        raise TelemetryError(f"{file}: holds no timestamp; {_REMEDY}")
    return int(text)


class Verifier:
    """Verify signatures. All links share one, so that a frame of one link cannot be replayed on another."""

    def __init__(self, key: bytes, clock: SigningClock) -> None:
        self._key: Final = key
        self._clock: Final = clock
        self._latest: dict[tuple[int, int, int], int] = {}  # timestamps, by system, component and link

    def check(self, frame: bytes, system: int, component: int, is_signed: bool) -> Rejection | None:
        """Return the reason to reject a frame, or None to accept it."""
        # Only a frame with a valid signature updates the sender's last timestamp.
        if not is_signed:
            return "unsigned"
        digest = hashlib.sha256(self._key + frame[:-_HASH_SIZE]).digest()
        if not hmac.compare_digest(digest[:_HASH_SIZE], frame[-_HASH_SIZE:]):
            return "forged"
        link = frame[-_SIGNATURE_SIZE]
        stamp = int.from_bytes(frame[-_HASH_SIZE - _STAMP_SIZE : -_HASH_SIZE], "little")
        sender = (system, component, link)
        latest = self._latest.get(sender)
        if latest is not None and stamp <= latest:
            return "replayed"
        if stamp > self._clock.latest_accepted:  # it would make later valid frames look old
            return "ahead"
        oldest = self._clock.now - _MINUTE
        if latest is None and (stamp < oldest or stamp <= self._clock.floor):
            return "old"
        if latest is None and len(self._latest) >= MAX_STREAMS and not self._drop_stale_sender(oldest):
            return "crowded"
        self._latest[sender] = stamp
        self._clock.advance_to(stamp)
        return None

    def _drop_stale_sender(self, oldest: int) -> bool:
        """Remove the sender silent for longest, if its frames would be rejected as too old; return True if removed."""
        sender = min(self._latest, key=self._latest.__getitem__)
        if self._latest[sender] >= oldest:
            return False
        del self._latest[sender]
        return True
