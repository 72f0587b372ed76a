"""Checks of mission download, upload and round trip."""

from __future__ import annotations

import time
from typing import Any

from tests.cosim.mavlink.conformance.connect import fetch_mission
from tests.cosim.mavlink.conformance.outcome import Check, Outcome, Subject, failed, judged, passed, skipped

_TIMEOUT = 1.5  # s
_DEPTHS = (-2.0, -3.0, -2.5)  # m, relative altitude of the items
_STEP = 100  # 1e-7 deg, between items
_SAME = ("command", "x", "y", "z", "frame")


def mission_lists(subject: Subject) -> Outcome:
    """Check that mission, fence and rally points are each answered, even if there are none."""
    m, said, good = subject.mavlink, [], True
    for name in ("MISSION", "FENCE", "RALLY"):
        kind = getattr(m, f"MAV_MISSION_TYPE_{name}")
        started = time.monotonic()
        items, text, retries = fetch_mission(subject.client, kind)
        said.append(f"{name.lower()}: {text}")
        good &= retries == 0 and time.monotonic() - started < _TIMEOUT and (items is not None or kind != 0)
    return judged(good, ", ".join(said), "an answer to each at the first asking")


def mission_round_trip(subject: Subject) -> Outcome:
    """Check that an uploaded mission is downloaded unchanged; the previous mission is restored."""
    m, client = subject.mavlink, subject.client
    before, text, _ = fetch_mission(client, m.MAV_MISSION_TYPE_MISSION)
    if before is None:
        return failed(text, "a list")
    here = client.last("GLOBAL_POSITION_INT")
    latitude, longitude = (0, 0) if here is None else (here.lat, here.lon)
    items = [_item(subject, i, latitude + i * _STEP, longitude, z) for i, z in enumerate(_DEPTHS)]
    result = upload(subject, items)
    if result == m.MAV_MISSION_DENIED:
        return skipped("the vehicle accepts no commands")
    after, text, _ = fetch_mission(client, m.MAV_MISSION_TYPE_MISSION)
    restored = upload(subject, before)
    received = f"ack {result}, {text} back, ack {restored} of the old one"
    if result != m.MAV_MISSION_ACCEPTED or after is None or len(after) != len(items):
        return failed(received, "ack 0, and as many items back")
    # item 0 of ArduPilot is home, and may differ
    first = 1 if subject.ardupilot else 0
    different = [
        f"item {a.seq}: {name} {getattr(a, name)}, not {getattr(b, name)}"
        for a, b in zip(after[first:], items[first:], strict=True)
        for name in _SAME
        if abs(getattr(a, name) - getattr(b, name)) > 1e-3 * (name == "z") + 1.0 * (name in "xy")
    ]
    if different:
        return failed(f"{received}; {'; '.join(different)}", "the same items back")
    return judged(restored == m.MAV_MISSION_ACCEPTED, received, "ack 0")


def bad_upload(subject: Subject) -> Outcome:
    """Check that an invalid item is refused, and the mission stays unchanged."""
    m, client = subject.mavlink, subject.client
    before, text, _ = fetch_mission(client, m.MAV_MISSION_TYPE_MISSION)
    here = client.last("GLOBAL_POSITION_INT")
    latitude, longitude = (0, 0) if here is None else (here.lat, here.lon)
    first, bad = (_item(subject, i, latitude, longitude, z) for i, z in enumerate((_DEPTHS[0], float("nan"))))
    bad.command = 65000  # not the first item, which may be home
    result = upload(subject, [first, bad])
    if result == m.MAV_MISSION_DENIED:
        return skipped("the vehicle accepts no commands")
    after, _, _ = fetch_mission(client, m.MAV_MISSION_TYPE_MISSION)
    received = f"ack {result}, {text} before, {None if after is None else len(after)} after"
    if result == m.MAV_MISSION_ACCEPTED and before is not None:
        upload(subject, before)
    if result is None or result == m.MAV_MISSION_ACCEPTED or before is None or after is None:
        return failed(received, "a refusal, and as many items as before")
    return judged(len(after) == len(before), received, "a refusal, and as many items as before")


def _item(subject: Subject, sequence: int, latitude: int, longitude: int, altitude: float) -> Any:
    m = subject.mavlink
    return m.MAVLink_mission_item_int_message(
        *subject.client.target, sequence, m.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, m.MAV_CMD_NAV_WAYPOINT,
        int(sequence == 0), 1, 0.0, 1.0, 0.0, float("nan"), latitude, longitude, altitude, m.MAV_MISSION_TYPE_MISSION,
    )  # fmt: skip


def upload(subject: Subject, items: list[Any]) -> int | None:
    """Upload a mission as ground stations do; return the type of the last MISSION_ACK, or None if none came."""
    m, client = subject.mavlink, subject.client
    kind = m.MAV_MISSION_TYPE_MISSION
    client.discard_unread()
    if not items:
        client.send(m.MAVLink_mission_clear_all_message(*client.target, kind))
    else:
        client.send(m.MAVLink_mission_count_message(*client.target, len(items), kind))
    wanted = ("MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_ACK")
    for _ in range(2 * len(items) + 2):
        reply = client.wait(lambda x: x.get_type() in wanted and x.mission_type == kind, _TIMEOUT)
        if reply is None:
            return None
        if reply.get_type() == "MISSION_ACK":
            return int(reply.type)
        if reply.seq < len(items):
            item = items[reply.seq]
            item.target_system, item.target_component = client.target
            client.send(item)
    return None


def mission_current(subject: Subject) -> Outcome:
    """Check that MISSION_CURRENT comes on request."""
    message = subject.client.request(subject.mavlink.MAVLINK_MSG_ID_MISSION_CURRENT)
    return passed(f"item {message.seq}") if message is not None else failed("nothing", "MISSION_CURRENT (42)")


CHECKS = (
    Check("mission-lists", ("QGC", "MAVSDK", "MAVProxy"), mission_lists),
    Check("mission-current", ("QGC", "MAVSDK"), mission_current),
    Check("mission-round-trip", ("QGC", "MAVSDK", "MAVProxy"), mission_round_trip),
    Check("mission-bad-item", ("all",), bad_upload),
)
