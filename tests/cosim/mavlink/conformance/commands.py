"""Checks of commands, modes, TIMESYNC and PING."""

from __future__ import annotations

import math
import time
from typing import Any

from tests.cosim.mavlink.conformance.outcome import Check, Outcome, Subject, failed, judged, passed, skipped

_QUICK = 0.5  # s, MAVSDK's timeout
_SETTLING = 2.0  # s, for the heartbeat to show what was commanded
_NO_COMMAND = 65000
_NO_SYSTEM = 77
_UNKNOWN_INT = 2**31 - 1  # value of an unused integer coordinate
_PX4_MAIN, _PX4_SUB = 16, 24  # bits by which main mode and sub-mode are shifted
_NOT_SELECTABLE = 2  # MAV_MODE_PROPERTY_NOT_USER_SELECTABLE


def one_ack(subject: Subject) -> Outcome:
    """Check that a command with NaN in unused numbers gets exactly one ack, for its sender, within MAVSDK's timeout."""
    m, client = subject.mavlink, subject.client
    command = m.MAV_CMD_REQUEST_MESSAGE
    started = time.monotonic()
    client.discard_unread()
    client.send_command(command, [m.MAVLINK_MSG_ID_SYS_STATUS])
    acks = [h for h in client.collect(0.8) if h.name == "COMMAND_ACK" and h.message.command == command]
    if len(acks) != 1:
        return failed(f"{len(acks)} acks", "one")
    took, ack = acks[0].time - started, acks[0].message
    target = ack.target_system, ack.target_component
    received = f"result {ack.result} after {1e3 * took:.0f} ms for {target}"
    good = ack.result == m.MAV_RESULT_ACCEPTED and took < _QUICK and target == client.identity
    return judged(good, received, f"result 0 within {_QUICK:g} s for {client.identity}")


def command_int(subject: Subject) -> Outcome:
    """Check that COMMAND_INT is executed like COMMAND_LONG, and gets one ack."""
    m, client = subject.mavlink, subject.client
    command, wanted = m.MAV_CMD_REQUEST_MESSAGE, m.MAVLINK_MSG_ID_AUTOPILOT_VERSION
    client.discard_unread()
    client.send(
        m.MAVLink_command_int_message(
            *client.target, m.MAV_FRAME_GLOBAL, command, 0, 0, wanted, math.nan, math.nan, math.nan,
            _UNKNOWN_INT, _UNKNOWN_INT, math.nan,
        )
    )  # fmt: skip
    heard = client.collect(0.8)
    acks = [h.message.result for h in heard if h.name == "COMMAND_ACK" and h.message.command == command]
    versions = sum(h.name == "AUTOPILOT_VERSION" for h in heard)
    return judged(acks == [m.MAV_RESULT_ACCEPTED] and versions == 1, f"acks {acks}, {versions} messages", "one of each")


def unsupported(subject: Subject) -> Outcome:
    """Check that an unknown command is refused as unsupported."""
    ack = subject.client.command(_NO_COMMAND, [0.0] * 7, 1.0)
    good = ack is not None and ack.result == subject.mavlink.MAV_RESULT_UNSUPPORTED
    return judged(good, f"ack {ack and ack.result}", "ack 3 (unsupported)")


def wrong_target(subject: Subject) -> Outcome:
    """Check that messages for another system get no answer."""
    m, client = subject.mavlink, subject.client
    client.discard_unread()
    client.send_command(m.MAV_CMD_REQUEST_MESSAGE, [m.MAVLINK_MSG_ID_AUTOPILOT_VERSION], (_NO_SYSTEM, 1))
    client.send(m.MAVLink_param_request_read_message(_NO_SYSTEM, 1, b"", 0))
    client.send(m.MAVLink_mission_request_list_message(_NO_SYSTEM, 1, 0))
    answers = {"COMMAND_ACK", "AUTOPILOT_VERSION", "PARAM_VALUE", "PARAM_ERROR", "MISSION_COUNT", "MISSION_ACK"}
    heard = sorted({h.name for h in client.collect(0.8)} & answers)
    return judged(not heard, ", ".join(heard) or "silence", "silence")


def broadcast(subject: Subject) -> Outcome:
    """Check that a broadcast command is answered."""
    m, client = subject.mavlink, subject.client
    client.discard_unread()
    client.send_command(m.MAV_CMD_REQUEST_MESSAGE, [m.MAVLINK_MSG_ID_AUTOPILOT_VERSION], (0, 0))
    version = client.wait(lambda x: x.get_type() == "AUTOPILOT_VERSION", 1.0)
    return judged(version is not None, "an answer" if version else "nothing", "AUTOPILOT_VERSION")


def arm_and_disarm(subject: Subject) -> Outcome:
    """Check that arming and disarming are accepted, and that the heartbeat shows them."""
    m, client = subject.mavlink, subject.client
    bit = m.MAV_MODE_FLAG_SAFETY_ARMED
    before = client.last("HEARTBEAT")
    was_armed = bool(before is not None and before.base_mode & bit)
    said = []
    for armed in (True, False, *([True] if was_armed else [])):
        ack = client.command(m.MAV_CMD_COMPONENT_ARM_DISARM, [armed, 0, 0, 0, 0, 0, 0])
        if ack is not None and ack.result == m.MAV_RESULT_DENIED:
            return skipped("the vehicle accepts no commands")
        shown = client.wait(_beat_shows(lambda b, armed=armed: bool(b.base_mode & bit) == armed), _SETTLING)
        said.append((ack and ack.result, shown is not None))
    good = all(item == (m.MAV_RESULT_ACCEPTED, True) for item in said)
    return judged(good, f"ack and shown: {said}", "ack 0, and shown, each time")


def set_modes(subject: Subject) -> Outcome:
    """Check that each selectable mode is accepted by its number, and shown in the heartbeat."""
    m, client = subject.mavlink, subject.client
    before = client.last("HEARTBEAT")
    modes = {h.message.custom_mode: h.message for h in client.recent("AVAILABLE_MODES")}
    if not modes or before is None:
        return skipped("no modes are known")
    packed = any(number > 0xFFFF for number in modes)
    refused: list[str] = []
    ignored = 0
    for number, mode in modes.items():
        if mode.properties & _NOT_SELECTABLE:
            continue
        ack = _set_mode(subject, number, packed)
        if ack is not None and ack.result == m.MAV_RESULT_DENIED and not refused:
            return skipped("the vehicle accepts no commands")
        shown = client.wait(_beat_shows(lambda b, number=number: b.custom_mode == number), _SETTLING)
        if ack is None or ack.result != m.MAV_RESULT_ACCEPTED or shown is None:
            ignored += ack is None or bool(ack.result == m.MAV_RESULT_ACCEPTED)
            text = client.last("STATUSTEXT")
            refused.append(f"{mode.mode_name} (ack {ack and ack.result}, {'shown' if shown else 'not shown'}")
            refused[-1] += f", {text.text!r})" if text is not None else ")"
    _set_mode(subject, before.custom_mode, packed)
    if ignored or len(refused) > 1:  # one, such as that of a mission that is not there, may be refused
        return failed("; ".join(refused), "ack 0, and shown")
    return passed(f"{len(modes) - len(refused)} of {len(modes)} modes{': not ' * bool(refused)}{''.join(refused)}")


def bad_mode(subject: Subject) -> Outcome:
    """Check that an unknown mode is refused, and changes nothing."""
    client = subject.client
    client.collect(1.2)  # until a heartbeat shows what was set before
    before = client.last("HEARTBEAT")
    ack = _set_mode(subject, 0xEE, packed=False)
    client.collect(1.2)
    after = client.last("HEARTBEAT")
    received = f"ack {ack and ack.result}, mode {before and before.custom_mode} then {after and after.custom_mode}"
    good = ack is not None and ack.result != 0 and before is not None and after.custom_mode == before.custom_mode
    return judged(good, received, "a refusal, and the mode as it was")


def _set_mode(subject: Subject, number: int, packed: bool) -> Any:
    m = subject.mavlink
    custom = float(m.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED)
    first, second = ((number >> _PX4_MAIN) & 0xFF, number >> _PX4_SUB) if packed else (number, 0)
    return subject.client.command(m.MAV_CMD_DO_SET_MODE, [custom, first, second, 0, 0, 0, 0])


def _beat_shows(shows: Any) -> Any:
    return lambda message: message.get_type() == "HEARTBEAT" and shows(message)


def timesync(subject: Subject) -> Outcome:
    """Check that TIMESYNC is answered with the client's time and the vehicle's own."""
    m, client = subject.mavlink, subject.client
    sent = time.monotonic_ns()
    client.discard_unread()
    client.send(m.MAVLink_timesync_message(0, sent))
    reply = client.wait(lambda x: x.get_type() == "TIMESYNC" and x.ts1 == sent, 1.0)
    if reply is None:
        return failed("nothing", "TIMESYNC with our time in ts1")
    return judged(reply.tc1 != 0, f"tc1 {reply.tc1}", "a clock that is not 0")


def ping(subject: Subject) -> Outcome:
    """Check that PING is answered to its sender."""
    m, client = subject.mavlink, subject.client
    if subject.ardupilot:
        return skipped("ArduPilot answers none")
    client.discard_unread()
    client.send(m.MAVLink_ping_message(time.time_ns() // 1000, 4711, 0, 0))
    reply = client.wait(lambda x: x.get_type() == "PING" and x.seq == 4711, 1.0)
    if reply is None:
        return failed("nothing", "PING with our number")
    target = reply.target_system, reply.target_component
    return judged(target == client.identity, f"for {target}", f"for {client.identity}")


CHECKS = (
    Check("one-ack", ("MAVSDK", "QGC"), one_ack),
    Check("command-int", ("MAVSDK",), command_int),
    Check("unsupported-command", ("all",), unsupported),
    Check("wrong-target", ("all",), wrong_target),
    Check("broadcast", ("MAVProxy", "Mission Planner"), broadcast),
    Check("arm-disarm", ("all",), arm_and_disarm),
    Check("set-modes", ("QGC", "MAVSDK", "MAVProxy"), set_modes),
    Check("bad-mode", ("all",), bad_mode),
    Check("timesync", ("QGC", "MAVSDK"), timesync),
    Check("ping", ("MAVSDK",), ping),
)
