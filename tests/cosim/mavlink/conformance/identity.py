"""Checks of the vehicle's identity: heartbeat, version, modes."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from tests.cosim.mavlink.conformance.connect import COMPONENT_METADATA
from tests.cosim.mavlink.conformance.outcome import Check, Outcome, Subject, failed, judged, passed, skipped

_LONGEST_SILENCE = 2.2  # s, after which Mission Planner reports a lost link
_MOST_BETWEEN = 200  # messages between two heartbeats, after which it does too
_QUICK = 0.5  # s, MAVSDK's timeout
_VERSION_3 = 3  # value of HEARTBEAT.mavlink_version


def heartbeat_identity(subject: Subject) -> Outcome:
    """Check that the heartbeat is an autopilot's, of the current MAVLink version."""
    m, vehicle, beat = subject.mavlink, subject.client.vehicle, subject.client.last("HEARTBEAT")
    if vehicle is None or beat is None:
        return failed("no heartbeat of component 1", "one a second")
    names = m.enums["MAV_TYPE"], m.enums["MAV_AUTOPILOT"], m.enums["MAV_STATE"]
    known = all(value in names[i] for i, value in enumerate((beat.type, beat.autopilot, beat.system_status)))
    received = f"system {vehicle.system}, type {beat.type}, autopilot {beat.autopilot}, base mode {beat.base_mode:#x}"
    good = known and vehicle.system != 0 and beat.mavlink_version == _VERSION_3
    return judged(
        good, received, f"known type, autopilot and state, version {_VERSION_3} (came {beat.mavlink_version})"
    )


def heartbeat_custom_mode(subject: Subject) -> Outcome:
    """Check that the heartbeat's base mode has the bit without which Cockpit and MAVProxy do not read the mode."""
    beat = subject.client.last("HEARTBEAT")
    bit = subject.mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    return judged(
        beat is not None and bool(beat.base_mode & bit),
        "no heartbeat" if beat is None else f"base mode {beat.base_mode:#x}, custom mode {beat.custom_mode}",
        "bit 0x1 of the base mode",
    )


def heartbeat_rate(subject: Subject) -> Outcome:
    """Check that heartbeats come once a second, and not too many messages between two of them."""
    beats = [i for i, heard in enumerate(subject.unasked) if heard.name == "HEARTBEAT"]
    times = [subject.unasked[i].time for i in beats]
    if len(beats) < 2:
        return failed(f"{len(beats)} in {subject.seconds:.1f} s", "one a second")
    silence = max(b - a for a, b in pairwise(times))
    between = max(b - a - 1 for a, b in pairwise(beats))
    received = f"{len(beats)} in {subject.seconds:.1f} s, {silence:.2f} s and {between} messages apart at the most"
    good = silence <= _LONGEST_SILENCE and between <= _MOST_BETWEEN and len(beats) <= 6 * subject.seconds
    return judged(good, received, f"up to {_LONGEST_SILENCE:g} s and {_MOST_BETWEEN} messages apart")


def mavlink_2(subject: Subject) -> Outcome:
    """Check that all frames are of MAVLink 2: QGroundControl accepts no other."""
    link = subject.client.link
    unknown, troubles = link.stats.unknown, link.loss_reports()
    received = [f"{subject.client.total} messages", f"{link.v1_frames} of MAVLink 1", f"{unknown} unknown", *troubles]
    return judged(
        link.v1_frames == unknown == 0 and not troubles, ", ".join(received), "only whole, known ones of MAVLink 2"
    )


def autopilot_version(subject: Subject) -> Outcome:
    """Check that AUTOPILOT_VERSION comes on request, with the capabilities that MAVSDK and QGroundControl need."""
    m = subject.mavlink
    version = subject.client.request(m.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    if version is None:
        return failed("nothing", "AUTOPILOT_VERSION (148) after command 512")
    needed = m.MAV_PROTOCOL_CAPABILITY_MAVLINK2 | m.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    good = version.capabilities & needed == needed
    return judged(good, f"capabilities {version.capabilities:#x}", "MAVLINK2 and MISSION_INT among them")


def available_modes(subject: Subject) -> Outcome:
    """Check that the modes come one by one, each with a unique number and a name."""
    m, client = subject.mavlink, subject.client
    found: list[Any] = []
    for index in range(1, 256):
        mode = client.request(m.MAVLINK_MSG_ID_AVAILABLE_MODES, index=index, timeout=1.0)
        if mode is None:
            if not found:
                return skipped("no AVAILABLE_MODES, as of ArduPilot") if subject.ardupilot else failed("none", "modes")
            return failed(f"mode {index} of {found[0].number_modes} did not come", "all, one by one")
        found.append(mode)
        if index >= mode.number_modes:
            break
    numbers = [mode.custom_mode for mode in found]
    good = (
        [mode.mode_index for mode in found] == list(range(1, len(found) + 1))
        and len(set(numbers)) == len(numbers)
        and all(mode.mode_name or mode.standard_mode for mode in found)
    )
    received = ", ".join(f"{mode.mode_name} {mode.custom_mode:#x}" for mode in found)
    return judged(good, received, "indices in order, and different numbers and names")


def current_mode(subject: Subject) -> Outcome:
    """Check that CURRENT_MODE has the custom mode of the heartbeat."""
    m = subject.mavlink
    mode = subject.client.request(m.MAVLINK_MSG_ID_CURRENT_MODE)
    beat = subject.client.last("HEARTBEAT")
    if mode is None or beat is None:
        return skipped("no CURRENT_MODE, as of ArduPilot") if subject.ardupilot else failed("nothing", "CURRENT_MODE")
    received = f"custom mode {mode.custom_mode}, heartbeat {beat.custom_mode}"
    return judged(mode.custom_mode == beat.custom_mode, received, "the same")


def component_metadata(subject: Subject) -> Outcome:
    """Check that a request for an unknown message is answered at once, or QGroundControl waits."""
    client, m = subject.client, subject.mavlink
    client.discard_unread()
    ack = client.command(m.MAV_CMD_REQUEST_MESSAGE, [COMPONENT_METADATA, 0, 0, 0, 0, 0, 0], _QUICK)
    if ack is None:
        return failed(f"no ack in {_QUICK:g} s", f"an ack for COMPONENT_METADATA ({COMPONENT_METADATA}) at once")
    return passed(f"ack {ack.result}")


CHECKS = (
    Check("heartbeat-identity", ("QGC", "MAVSDK", "MAVProxy", "Mission Planner", "Cockpit"), heartbeat_identity),
    Check("heartbeat-custom-mode", ("Cockpit", "MAVProxy"), heartbeat_custom_mode),
    Check("heartbeat-rate", ("QGC", "Mission Planner"), heartbeat_rate),
    Check("autopilot-version", ("QGC", "MAVSDK", "Mission Planner"), autopilot_version),
    Check("available-modes", ("QGC",), available_modes),
    Check("current-mode", ("QGC",), current_mode),
    Check("component-metadata", ("QGC",), component_metadata),
)
LAST = (Check("mavlink-2", ("QGC",), mavlink_2),)  # over all received messages
