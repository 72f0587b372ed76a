"""PX4's simulator interface: a TCP server that sends sensor data, and makes a step for each answer."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from cosim.mavlink.wire.dialect import dialect, make_heartbeat
from cosim.mavlink.wire.options import ORIGIN
from cosim.simulation.pace import Pace
from cosim.sitl.hil_messages import RATE, hil_messages
from cosim.sitl.lockstep_server import POLL, LockstepServer
from cosim.sitl.motion import Motion, at_rest
from cosim.sitl.sitl_flight import Flight

LEFT = "ended: the autopilot left"
SYSTEM_ID, COMPONENT_ID = 254, 25  # identity of the simulator, unlike those of vehicles and ground stations

_GPS_EVERY, _HEARTBEAT_EVERY = RATE // 10, RATE
_ARMED = 128  # bit of HIL_ACTUATOR_CONTROLS.mode
_SEND_TIMEOUT = 5.0  # s of the wall clock, timeout of sending a frame
_CHANNELS = 16


class _DisconnectedError(Exception):
    """The autopilot has closed the connection."""


class _SilentError(Exception):
    """The autopilot has sent nothing for longer than the timeout."""


@dataclass(eq=False)
class HilServer(LockstepServer):
    """Fly the plant in lockstep with a PX4."""

    # PX4 starts up by the wall clock; meanwhile the vehicle is held at its start, and then until it is armed. The run
    # begins with the first actuator controls of an armed vehicle, and each one from then on makes one step.

    kind = socket.SOCK_STREAM
    speedup: float | None = None  # simulated seconds per second of the wall clock; None: as fast as possible

    def __post_init__(self) -> None:
        super().__post_init__()
        self._mavlink = dialect()  # imported before PX4 waits for it

    def _serve(self) -> str:
        while True:
            try:
                connection, peer = self._accept()
            except _SilentError as error:
                return str(error)
            with connection:
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                flight = self.flights.begin(RATE)
                self.report(f"{flight.folder}: {peer[0]}:{peer[1]} flies, {RATE} frames a simulated second")
                try:
                    self._fly(flight, connection)
                except _DisconnectedError:
                    self.flights.end(LEFT)
                except _SilentError as error:
                    return str(error)
                else:
                    return "completed"

    def _accept(self) -> tuple[socket.socket, tuple[str, int]]:
        while True:
            try:
                accepted = self._socket.accept()
            except TimeoutError:
                self._check_timeout()
            else:
                self._received = time.monotonic()
                return accepted

    def _fly(self, flight: Flight, connection: socket.socket) -> None:
        """Fly with one connection until the scenario's end."""
        codec = self._mavlink.MAVLink(None, srcSystem=SYSTEM_ID, srcComponent=COMPONENT_ID)
        codec.robust_parsing = True
        motion = at_rest(flight.motion())
        frame = 0  # number of frames on PX4's clock, which is never reset
        controls: Iterator[tuple[bool, list[float]]] = iter(())
        pace = None if self.speedup is None else Pace(1.0 / (RATE * self.speedup))
        while not flight.done:
            if pace is not None:
                pace.wait()
            self._send(connection, codec, motion, frame)
            frame += 1
            while (answer := next(controls, None)) is None:
                data = self._receive(connection, waits=flight.steps + flight.waited > 0)
                if data is None:  # PX4 is still starting: its clock must advance
                    break
                controls = iter(self._controls(codec, data))
            if answer is None:
                continue
            is_armed, outputs = answer
            if flight.steps or is_armed:
                self.flights.law.set_outputs(outputs)
                motion = flight.step()
                self.counts.steps += 1
            else:
                flight.waited += 1
                self.counts.waited += 1

    def _send(self, connection: socket.socket, codec: Any, motion: Motion, frame: int) -> None:
        m = self._mavlink
        time_us = (frame + 1) * 1_000_000 // RATE
        messages = hil_messages(m, motion, time_us, ORIGIN, frame % _GPS_EVERY == 0)
        if frame % _HEARTBEAT_EVERY == 0:
            messages.insert(0, make_heartbeat(m, m.MAV_TYPE_GENERIC, m.MAV_STATE_UNINIT))
        data = b""
        for message in messages:
            data += message.pack(codec)
            codec.seq = (codec.seq + 1) % 256
        connection.settimeout(_SEND_TIMEOUT)
        try:
            connection.sendall(data)
        except OSError as error:  # the stream may end within a message
            raise _DisconnectedError from error

    def _receive(self, connection: socket.socket, *, waits: bool) -> bytes | None:
        """Receive bytes; return None if `waits` is False and none arrive within a frame's time of the wall clock."""
        connection.settimeout(POLL if waits else 1.0 / RATE)
        while True:
            try:
                data = connection.recv(4096)
            except TimeoutError:
                self._check_timeout()
                if not waits:
                    return None
            except OSError as error:
                raise _DisconnectedError from error
            else:
                if not data:
                    raise _DisconnectedError
                self._received = time.monotonic()
                return data

    def _controls(self, codec: Any, data: bytes) -> list[tuple[bool, list[float]]]:
        """Parse the actuator controls in received bytes: whether armed, and outputs, which are 0 while disarmed."""
        controls = []
        for message in codec.parse_buffer(data) or ():
            kind = message.get_type()
            if kind == "BAD_DATA":
                self.counts.malformed += 1
            elif kind == "HIL_ACTUATOR_CONTROLS":
                is_armed = bool(message.mode & _ARMED)
                controls.append((is_armed, list(message.controls) if is_armed else [0.0] * _CHANNELS))
        return controls

    def _check_timeout(self) -> None:
        if silence := self._silence():
            raise _SilentError(silence)
