"""All checks, one after the other, of the vehicle at the other end of a link."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

from cosim.errors import TelemetryError
from cosim.mavlink.wire.ground_end import GroundLink, ReceivedMessage
from tests.cosim.mavlink.conformance import commands, identity, missions, parameters, streams
from tests.cosim.mavlink.conformance.client import Client
from tests.cosim.mavlink.conformance.connect import qgc_connect
from tests.cosim.mavlink.conformance.outcome import Check, Outcome, Subject, failed, judged, speed_of

LISTENING = 6.0  # s of the vehicle's clock, in which its streams are recorded before any request
_LONGEST = 60.0  # s of the wall clock, for a vehicle whose clock is slow
_FINDING = 10.0  # s, timeout of the first heartbeat
_GONE = 5.0  # s of silence, after which the vehicle counts as gone
_QUICK = 0.5  # s, timeout of an ack


@dataclass(frozen=True)
class Result:
    """A finished check, its outcome and its time."""

    check: Check
    outcome: Outcome
    seconds: float  # s of the wall clock, duration of the check


def connect_as_qgc(subject: Subject) -> Outcome:
    """Check that QGroundControl's connecting needs no retry."""
    connection = qgc_connect(subject.client)
    took = f"{connection.seconds:.2f} s, {connection.retries} retries"
    if not connection.good:
        bad = next((step for step in connection.steps if not step.good), None)
        return failed(f"{took}; {bad.name if bad else 'no heartbeat'}: {bad.said if bad else ''}", "all steps")
    slowest = max(connection.steps, key=lambda step: step.seconds)
    received = f"{took}, {len(connection.steps)} steps, {slowest.name} {slowest.seconds:.2f} s"
    return judged(connection.retries == 0, received, "no retry")


def no_gaps(subject: Subject) -> Outcome:
    """Check that the sequence numbers of all received frames have no gaps."""
    client = subject.client
    return judged(client.lost == 0, f"{client.total} messages, {client.lost} missing", "none missing")


CHECKS: tuple[Check, ...] = (
    *identity.CHECKS,
    *streams.CHECKS,
    *commands.CHECKS,
    *parameters.CHECKS,
    *missions.CHECKS,
    Check("qgc-connect", ("QGC",), connect_as_qgc),
    Check("sequence-numbers", ("all",), no_gaps),
    *identity.LAST,
)


def check_vehicle(link: GroundLink) -> Iterator[Result]:
    """Check a vehicle, and yield each result when its check ends."""
    client = Client(link)
    if client.find(_FINDING) is None:
        raise TelemetryError(f"{link.name}: no vehicle was heard in {_FINDING:g} s")
    client.discard_unread()
    subject = Subject(client, *_listen(client))
    for check in CHECKS:
        started = time.monotonic()
        outcome = check.run(subject)
        if time.monotonic() - client.last_heard > _GONE:
            raise TelemetryError(f"{link.name}: the vehicle has gone, in check {check.name}")
        yield Result(check, outcome, time.monotonic() - started)
    _restore_rates(subject)


def _listen(client: Client) -> tuple[tuple[ReceivedMessage, ...], float]:
    """Return the messages that the vehicle streams unasked, and the time of recording [s of the wall clock]."""
    started, passed = time.monotonic(), 0.0
    heard: tuple[ReceivedMessage, ...] = ()
    while passed < _LONGEST and (left := LISTENING - passed * speed_of(heard)) > 0.0:
        heard += tuple(client.collect(left))
        passed = time.monotonic() - started
    return heard, passed


def _restore_rates(subject: Subject) -> None:
    """Request the default rates of all unasked messages, of which connecting as QGroundControl has changed some."""
    m = subject.mavlink
    for number in sorted({heard.message.get_msgId() for heard in subject.unasked}):
        subject.client.command(m.MAV_CMD_SET_MESSAGE_INTERVAL, [number, 0, 0, 0, 0, 0, 0], _QUICK)
