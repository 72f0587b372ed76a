"""The vehicle's side of MAVLink: outgoing messages, and handling of received ones. No sockets, no threads."""

from __future__ import annotations

import math
from typing import Any

from cosim.mavlink.event_texts import EventTexts
from cosim.mavlink.messages.message_table import build_messages
from cosim.mavlink.messages.streams import Streams
from cosim.mavlink.services.attitude_targets import AttitudeTargets
from cosim.mavlink.services.command_protocol import CommandProtocol
from cosim.mavlink.services.ftp import FileServer
from cosim.mavlink.services.gcs_failsafe import GcsFailsafe
from cosim.mavlink.services.manual import ManualControlService
from cosim.mavlink.services.mission import MissionProtocol
from cosim.mavlink.services.mode_commands import ModeCommands
from cosim.mavlink.services.origin import Origin
from cosim.mavlink.services.parameter_protocol import ParameterProtocol
from cosim.mavlink.services.received_obstacles import ReceivedObstacles
from cosim.mavlink.services.requests import LogProtocol, Requests, Timing, banner
from cosim.mavlink.services.service import Handler, Service
from cosim.mavlink.services.targets import Targets
from cosim.mavlink.vehicle.vehicle_context import Sender, VehicleContext
from cosim.mavlink.wire.link import Link
from cosim.mavlink.wire.options import COMPONENT_ID
from cosim.simulation.signals import Array

_HEARTBEAT_PERIOD = 1.1  # s of the wall clock without a heartbeat, after which one is sent: above the stream's second
_SNAPSHOT_TIMEOUT = 0.5  # s of the wall clock without a snapshot, after which streams go by that clock
_SECOND = 1_000_000


class Autopilot:
    """The running co-simulation as a MAVLink vehicle."""

    # Streams follow simulated time. So does the time since boot, plus the wall time spent waiting for arming. Timeouts
    # of ground stations follow the wall clock, and so do the streams while simulated time stands still. No received
    # message raises. All methods are called from one thread.

    def __init__(self, context: VehicleContext) -> None:
        self._context = context
        self._streams: dict[Link, Streams] = {}
        self._events = EventTexts(context)
        parameters = ParameterProtocol(context)
        targets = Targets(context, parameters)
        services: list[Service] = [
            Requests(context, self._streams),
            ModeCommands(context),
            targets,
            AttitudeTargets(context),
            ReceivedObstacles(context),
            ManualControlService(context),
            parameters,
            MissionProtocol(context, targets, parameters),
            FileServer(context, parameters),
            LogProtocol(context),
            Timing(context),
            Origin(context),
            GcsFailsafe(context),
        ]
        self._services = [*services, CommandProtocol(context, services)]
        self._handlers: dict[str, Handler] = {}
        for service in self._services:
            self._handlers.update(service.messages)
        self._clock_us = 0  # of the streams; never decreases
        self._last_us: int | None = None  # simulated time of the last snapshot
        self._awaits_arming = False  # True while the run waits for arming: simulated time is still 0
        self._has_advanced = False  # True if simulated time has advanced since the last tick
        self._advanced_at = -math.inf
        self._heartbeat_at: dict[Link, float] = {}
        self._last_tick: float | None = None

    def attach(self, link: Link) -> None:
        """Start streaming on a link."""
        self._context.links.append(link)
        self._streams[link] = Streams(self._context, link, self._clock_us)
        for message in banner(self._context):
            link.send(message)

    def observe(self, row: Array) -> None:
        """Update from the next snapshot, and send the messages that are due by simulated time; row (n,) [s]."""
        context = self._context
        context.update(row)
        now = context.view.simulated_us
        if (self._last_us is not None and now < self._last_us) or (now == 0 and context.run_has_ended):
            self._restart()
            context.update(row)
        self._awaits_arming = now == self._last_us == 0  # the snapshot of time 0 is repeated
        self._has_advanced |= now != self._last_us
        self._clock_us += max(0, now - (now if self._last_us is None else self._last_us))
        self._last_us = now
        self._events.watch()
        for service in self._services:
            service.on_snapshot()
        self._advance()

    def _restart(self) -> None:
        context = self._context
        context.restart()
        self._events.restart()
        for service in self._services:
            service.restart()
        context.send_text("The run has restarted", "NOTICE")

    def _advance(self) -> None:
        for streams in list(self._streams.values()):
            streams.advance(self._clock_us)

    def receive(self, link: Link, message: Any, now: float) -> None:
        """Pass a message to its handler, if it targets the autopilot, or all components; now [s]."""
        # Its sender is allowed, and it targets this system: the link's filter has rejected all others.
        self._context.now = now
        handler = self._handlers.get(message.get_type())
        is_for_us = getattr(message, "target_component", 0) in (0, COMPONENT_ID)
        if handler is not None and is_for_us and link in self._streams:
            handler(Sender(link, message.get_srcSystem(), message.get_srcComponent()), message)

    def tick(self, now: float) -> None:
        """Run timeouts and streams of the wall clock; call it at least every 20 ms; now [s]."""
        context = self._context
        context.now = now
        elapsed = 0.0 if self._last_tick is None else min(max(now - self._last_tick, 0.0), 1.0)
        self._last_tick = now
        if self._has_advanced:
            self._has_advanced, self._advanced_at = False, now
        elif self._last_us is not None and now - self._advanced_at >= _SNAPSHOT_TIMEOUT:
            self._clock_us += round(elapsed * _SECOND)
            if self._awaits_arming:
                context.waited_us += round(elapsed * _SECOND)
            self._advance()
        for service in self._services:
            service.tick()
        context.status_texts.send_due()
        for link, streams in list(self._streams.items()):
            if streams.heartbeat_sent or link not in self._heartbeat_at:
                streams.heartbeat_sent = False
                self._heartbeat_at[link] = now
            elif now - self._heartbeat_at[link] >= _HEARTBEAT_PERIOD:
                streams.send(context.mavlink.MAVLINK_MSG_ID_HEARTBEAT)

    def close(self, now: float) -> None:
        """Send a status text that the run has ended, and a last heartbeat in standby."""
        context = self._context
        context.now = now
        context.send_text(f"The {'run' if context.live else 'recording'} has ended", "NOTICE")
        context.has_ended = True
        for message in build_messages(context, "HEARTBEAT"):
            context.send(message)
