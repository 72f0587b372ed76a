"""The run as MAVLink 2 telemetry, sent by a thread of its own."""

from __future__ import annotations

import ipaddress
import logging
import socket
import struct
import threading
import time
from collections import deque
from typing import Any

import numpy as np

from controller.quaternion import rotation_matrix
from cosim.errors import TelemetryError
from cosim.scenario import CRITERIA
from cosim.signals import Array, Signals

log = logging.getLogger(__name__)

SYSTEM_ID = 1
COMPONENT_ID = 1  # MAV_COMP_ID_AUTOPILOT1: ground stations listen to no other

POSE_PERIOD = 0.1  # s, simulated
TIME_PERIOD = 1.0  # s, simulated
HEARTBEAT_PERIOD = 1.0  # s, of the wall clock
_QUEUED = 4096  # snapshots; when the sender falls behind, the oldest go
_CLOSING = 2.0  # s, that closing waits for what is queued
_FLOAT_MAX = 3.4e38  # beyond it a float32 field cannot be encoded
_UINT32 = 0xFFFFFFFF


def _float32(x: float) -> float:
    """Return a number that a float32 field can hold; NaN stays."""
    return min(max(x, -_FLOAT_MAX), _FLOAT_MAX)


def parse_endpoint(text: str, allow_remote: bool = False) -> tuple[str, int]:
    """Return host and port of an endpoint such as ``udpout:127.0.0.1:14550``.

    Parameters
    ----------
    text : str
        As pymavlink and MAVProxy write it.
    allow_remote : bool
        Accept addresses beyond this machine: MAVLink has no privacy.

    Returns
    -------
    (str, int)
        Address and port.

    Raises
    ------
    TelemetryError
        If it is none, or leaves this machine without leave.
    """
    kind, _, rest = text.partition(":")
    host, _, port = rest.rpartition(":")
    if kind != "udpout" or not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise TelemetryError(f"--mavlink {text!r}: expected udpout:HOST:PORT, such as udpout:127.0.0.1:14550")
    try:
        address = socket.getaddrinfo(host, int(port), socket.AF_INET, socket.SOCK_DGRAM)[0][4][0]
    except (OSError, UnicodeError) as error:
        raise TelemetryError(f"--mavlink {text!r}: host {host!r} is not known: {error}") from error
    if not allow_remote and not ipaddress.ip_address(address).is_loopback:
        raise TelemetryError(f"--mavlink {text!r}: {address} is beyond this machine; --allow-remote lets it through")
    return str(address), int(port)


class Telemetry:
    """Observer that streams heartbeat, time, pose, weights and estimates as a MAVLink vehicle.

    Rates go by simulated time, and so does the time since boot in the messages; the heartbeat goes by the wall clock.
    The stepper only copies a row now and then; whatever happens on the link stays in the thread, which `start` begins.

    Parameters
    ----------
    address : (str, int)
        Where to send, by UDP.
    signals : Signals
        Of the run.
    step : float
        Step of the run [s].

    Attributes
    ----------
    dropped : int
        Snapshots that were overtaken by newer ones.
    failed : int
        Messages that could not be sent.

    Raises
    ------
    TelemetryError
        If pymavlink is not installed, or no socket can be had.
    """

    def __init__(self, address: tuple[str, int], signals: Signals, step: float) -> None:
        try:
            from pymavlink.dialects.v20 import all as mavlink
        except ImportError as error:
            raise TelemetryError("MAVLink needs pymavlink; pip install 'subreach[mavlink]'") from error
        self._mavlink = mavlink
        self._codec = mavlink.MAVLink(None, srcSystem=SYSTEM_ID, srcComponent=COMPONENT_ID)
        self._every = max(1, round(POSE_PERIOD / step))
        self._slow_every = self._every * max(1, round(TIME_PERIOD / POSE_PERIOD))
        self._at = {column.name: i for i, column in enumerate(signals.columns)}
        self._queue: deque[tuple[bool, Array]] = deque(maxlen=_QUEUED)
        self._wake = threading.Condition()
        self._closing = False
        self.dropped = self.failed = 0
        self._address = address
        try:
            self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._socket.setblocking(False)
        except OSError as error:
            raise TelemetryError(f"no UDP socket: {error.strerror or error}") from error
        self._thread = threading.Thread(target=self._send_queued, name="mavlink", daemon=True)

    def start(self) -> None:
        """Begin to send."""
        self._thread.start()

    def observe(self, k: int, row: Array) -> None:
        """Queue a copy of the row of step `k`, where one is due."""
        if k % self._every:
            return
        with self._wake:
            self.dropped += len(self._queue) == _QUEUED
            self._queue.append((k % self._slow_every == 0, row.copy()))
            self._wake.notify()

    def close(self) -> None:
        """Send what is queued, within a bounded time, say goodbye, and end the thread."""
        with self._wake:
            self._closing = True
            self._wake.notify()
        if self._thread.is_alive():
            self._thread.join(_CLOSING)
        if self.dropped or self.failed:
            log.warning("MAVLink: %d snapshots dropped, %d messages not sent", self.dropped, self.failed)
        self._socket.close()

    # ---- in the thread ----

    def _send_queued(self) -> None:
        m = self._mavlink
        next_beat = time.monotonic()
        while True:
            now = time.monotonic()
            if now >= next_beat:  # by the wall clock, as ground stations count
                self._send(self._heartbeat(m.MAV_STATE_ACTIVE))
                next_beat = now + HEARTBEAT_PERIOD
            with self._wake:
                if not self._queue and not self._closing:
                    self._wake.wait(max(0.0, next_beat - time.monotonic()))
                due = self._queue.popleft() if self._queue else None
                if due is None and self._closing:
                    break
            if due is not None:
                self._send_row(*due)
        self._send(self._heartbeat(m.MAV_STATE_STANDBY))

    def _send_row(self, slow: bool, row: Array) -> None:
        try:
            messages = self._messages(slow, row)
        except (ValueError, OverflowError) as error:  # such as a time that is no number
            self.failed += 1
            log.debug("MAVLink: %s", error)
            return
        for message in messages:
            self._send(message)

    def _send(self, message: Any) -> None:
        try:
            self._socket.sendto(message.pack(self._codec), self._address)
            self._codec.seq = (self._codec.seq + 1) % 256
        except (OSError, struct.error, OverflowError) as error:  # nobody listens, or the buffer is full
            self.failed += 1
            log.debug("MAVLink: %s", error)

    def _messages(self, slow: bool, row: Array) -> list[Any]:
        m, at = self._mavlink, self._at

        def values(first: str, n: int) -> list[float]:
            return [_float32(x) for x in row[at[first] : at[first] + n].tolist()]

        boot_ms = round(row[at["time"]] * 1e3) & _UINT32
        e0, e1, e2, e3 = values("quaternion.e0", 4)
        rates = values("velocity.p", 3)
        messages: list[Any] = []
        if slow:
            messages.append(m.MAVLink_system_time_message(time.time_ns() // 1000, boot_ms))
        messages += [
            m.MAVLink_attitude_message(boot_ms, *values("attitude.roll", 3), *rates),
            m.MAVLink_attitude_quaternion_message(boot_ms, e0, e1, e2, e3, *rates),
            m.MAVLink_local_position_ned_message(
                boot_ms, *values("position.x", 3), *map(_float32, self._velocity_ned(row))
            ),
        ]
        named = {f"w_{name}": f"weight.{name}" for name in CRITERIA} | {
            f"phi{i}": f"estimate.phi{i}" for i in range(1, 5)
        }
        messages += [
            m.MAVLink_named_value_float_message(boot_ms, name.encode(), *values(column, 1))
            for name, column in named.items()
        ]
        return messages

    def _velocity_ned(self, row: Array) -> list[float]:
        at = self._at
        R = rotation_matrix(row[at["quaternion.e0"] : at["quaternion.e0"] + 4])
        with np.errstate(invalid="ignore", over="ignore"):
            velocity: list[float] = (R @ row[at["velocity.u"] : at["velocity.u"] + 3]).tolist()  # (15)
        return velocity

    def _heartbeat(self, state: int) -> Any:
        m = self._mavlink
        mode = m.MAV_MODE_FLAG_GUIDED_ENABLED | m.MAV_MODE_FLAG_AUTO_ENABLED
        if state == m.MAV_STATE_ACTIVE:
            mode |= m.MAV_MODE_FLAG_SAFETY_ARMED
        return m.MAVLink_heartbeat_message(m.MAV_TYPE_SUBMARINE, m.MAV_AUTOPILOT_GENERIC, mode, 0, state, 3)
