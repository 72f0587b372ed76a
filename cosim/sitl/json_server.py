"""Server of ArduPilot's JSON backend: answers each UDP frame of the autopilot with the plant's next state."""

from __future__ import annotations

import logging
import math
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from cosim.sitl import json_protocol
from cosim.sitl.lockstep_server import LockstepServer
from cosim.sitl.sitl_session import MIN_RATE, RESTARTED

log = logging.getLogger(__name__)

Sender = tuple[str, int]

_SENDER_TIMEOUT = 1.0  # s of the wall clock without frames, after which another sender is accepted
_RESEND_PERIOD = 0.5  # s of the wall clock, below an autopilot's least time from a frame to its repetition
_WARNING_PERIOD = 10.0  # s of the wall clock, between two warnings of one kind


@dataclass(eq=False)
class JsonServer(LockstepServer):
    """Fly the plant in lockstep with an ArduPilot."""

    kind = socket.SOCK_DGRAM
    # frames that the autopilot has counted, one more with each answer that it has received; None before the first
    before_answer: Callable[[], None] = lambda: None  # called while the autopilot waits for its answer
    _count: int | None = field(default=None, init=False)
    _sender: Sender | None = field(default=None, init=False)
    _answer: bytes = field(default=b"", init=False)
    _answered: float = field(default=-math.inf, init=False)  # s of the wall clock
    _warned: dict[str, float] = field(default_factory=dict, init=False)  # s, time of the last warning of each kind

    def _serve(self) -> str:
        while not (status := self.poll()):
            pass
        return status

    def poll(self) -> str:
        """Answer the next frame, or wait for one for at most 0.25 s; return the run's status once it has ended."""
        try:
            data, sender = self._socket.recvfrom(json_protocol.MAX_SIZE + 1)
        except OSError:  # timeout; or the report of an earlier answer that was refused
            data, sender = b"", None
        now = time.monotonic()
        if sender is not None and self._accept(data, sender, now):
            self._received = now
            if self.flights.flight is not None and self.flights.flight.done:
                return "completed"
            return ""
        return self._silence()

    def _accept(self, data: bytes, sender: Sender, now: float) -> bool:
        """Process a datagram; return True if it is a valid one of the autopilot."""
        packet = json_protocol.parse_packet(data)
        if packet is None or packet.frame_rate < MIN_RATE:
            self.counts.malformed += 1
            what = "not a servo packet" if packet is None else f"a servo packet of {packet.frame_rate} frames a second"
            self._warn("malformed", f"{len(data)} bytes from {sender[0]}:{sender[1]}, {what}: ignored")
            return False
        if sender != self._sender and not self._accept_sender(packet, sender, now):
            return False
        last, self._count = self._count, packet.frame_count
        if packet.frame_count == last:
            self.counts.resent += 1
            if now - self._answered < _RESEND_PERIOD:  # it was on its way as the answer was sent
                return True
        else:
            if last is None or packet.frame_count < last:
                self._begin(packet.frame_rate)
            elif packet.frame_count > last + 1:
                self._count_lost(packet.frame_count - last - 1)
            self._step(packet)
            self.before_answer()
        self._answered = time.monotonic()
        try:
            self._socket.sendto(self._answer, sender)
        except OSError as error:
            self.counts.unsent += 1
            self._warn("sending", f"UDP to {sender[0]}:{sender[1]}: {error.strerror or error}")
        return True

    def _accept_sender(self, packet: json_protocol.ServoPacket, sender: Sender, now: float) -> bool:
        """Accept a new sender unless the one before is still active; return True if accepted."""
        if self._sender is not None:
            present = f"{self._sender[0]}:{self._sender[1]}"
            if now - self._received < _SENDER_TIMEOUT:
                self.counts.rejected += 1
                self._warn("rejected", f"{sender[0]}:{sender[1]} also sends, beside {present}: rejected")
                return False
            if self._count is None or packet.frame_count != self._count + 1:
                self._count = None  # another autopilot, not the same from another port: restart for any count
        self._sender = sender
        return True

    def _begin(self, frame_rate: int) -> None:
        if self.flights.flight is not None:
            self.flights.end(RESTARTED)
        flight = self.flights.begin(frame_rate)
        sender = f"{self._sender[0]}:{self._sender[1]}" if self._sender else "no sender"
        self.report(f"{flight.folder}: {sender} flies, {frame_rate} frames a simulated second")

    def _count_lost(self, missed: int) -> None:
        self.counts.lost += missed
        self.flights.law.lost += missed
        self._warn("lost", f"{missed} frames of the autopilot lost: one step is made for all")

    def _step(self, packet: json_protocol.ServoPacket) -> None:
        flight = self.flights.flight
        assert flight is not None
        law = self.flights.law
        law.set_outputs(packet.pwm)
        if flight.steps or (law.is_driving and flight.can_start):
            motion = flight.step()
            self.counts.steps += 1
        else:  # the autopilot starts, or is not armed yet
            motion = flight.wait()
            self.counts.waited += 1
        if law.link is not None:
            law.link.exchange(motion)
        self._answer = json_protocol.format_motion(motion)

    def _warn(self, kind: str, text: str) -> None:
        """Log a warning, with a limited rate for each kind."""
        now = time.monotonic()
        if now - self._warned.get(kind, -_WARNING_PERIOD) >= _WARNING_PERIOD:
            self._warned[kind] = now
            log.warning("%s", text)
