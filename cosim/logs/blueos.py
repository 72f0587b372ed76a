"""Recordings of BlueOS: MCAP files with each MAVLink message as JSON."""

from __future__ import annotations

import contextlib
import functools
import json
import math
import operator
import re
from pathlib import Path
from typing import Any

from cosim.errors import ImportLogError
from cosim.logs.bag_records import StoredMessage
from cosim.logs.bag_storage import MAX_DECODED, stored_messages
from cosim.logs.cleaning.clocks import Clock
from cosim.logs.records import DAMAGE, OnProgress
from cosim.logs.spool import LogContents
from cosim.logs.vehicle_messages import AUTOPILOT, MESSAGES, NO_AUTOPILOT, VehicleMessages
from cosim.mavlink.wire.dialect import dialect

_ALL_MESSAGES = "mavlink/out"  # topic of all messages; each is also recorded with the topic of its kind
# topics of one kind of message, such as mavlink/1/1/ATTITUDE; topics of single fields are longer
_ONE_KIND = re.compile(r"mavlink/\d+/\d+/[A-Z0-9_]+")


def read_recording(
    path: Path, by_kind: bool, vehicle: tuple[int, int, int], contents: LogContents, on_progress: OnProgress
) -> None:
    """Read a recording, or the folder with the recordings of a dive, of what `find_vehicle` has found."""
    clock, messages = Clock(), VehicleMessages(contents, *vehicle)
    kinds = {kind.msgname: kind for kind in dialect().mavlink_map.values()}
    for stored in stored_messages(path, contents.remarks, on_progress):
        if not stored.topic.startswith("mavlink"):
            contents.unread[stored.topic] += 1
        if not (_ONE_KIND.fullmatch(stored.topic) if by_kind else stored.topic == _ALL_MESSAGES):
            continue
        written, name = clock.time(stored.time, stored.topic), "message"
        try:
            header, fields = _parts(stored)
            name = fields["type"]
            if name in MESSAGES:
                message = kinds[name](**_values(kinds[name], fields))
                messages.add(header["system_id"], header["component_id"], message, written)
            elif name != "HEARTBEAT":
                contents.unread[name] += 1
        except DAMAGE:
            contents.unread[f"{name} that is not as expected"] += 1
    contents.remarks += clock.remarks("The clock of the recorder")


def find_vehicle(path: Path) -> tuple[bool, tuple[int, int, int]] | None:
    """Return True if each kind of message has a topic, and the autopilot's identity; None for a bag without MAVLink."""
    # The identity is system id, MAV_AUTOPILOT and MAV_TYPE.
    vehicle, any_mavlink = None, False
    for stored in stored_messages(path, [], lambda fraction: None):
        by_kind = _ONE_KIND.fullmatch(stored.topic) is not None
        is_mavlink = by_kind or stored.topic == _ALL_MESSAGES
        any_mavlink |= is_mavlink
        if not is_mavlink or b"HEARTBEAT" not in stored.data:
            continue
        with contextlib.suppress(*DAMAGE):
            header, fields = _parts(stored)
            autopilot, kind = _value(fields["autopilot"]), _value(fields["mavtype"])
            if header["component_id"] == AUTOPILOT and autopilot != NO_AUTOPILOT:
                vehicle = int(header["system_id"]), int(autopilot), int(kind)
                if by_kind:
                    return True, vehicle
    if not any_mavlink:
        return None
    if vehicle is None:
        raise ImportLogError("holds no heartbeat of an autopilot, expected a recording of a vehicle")
    return False, vehicle


def _parts(stored: StoredMessage) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return header and fields of a message."""
    if len(stored.data) > MAX_DECODED:
        raise ValueError("is too large")
    whole = json.loads(stored.data)
    return whole["header"], whole["message"]


def _values(kind: Any, fields: dict[str, Any]) -> dict[str, Any]:
    """Return the values of the fields of a kind of message; missing MAVLink 2 fields are 0, as on the wire."""
    values = {}
    for name, unit in zip(kind.fieldnames, kind.fieldtypes, strict=True):
        value = fields.get("mavtype" if name == "type" else name, 0)  # since "type" is the message's own name
        values[name] = "".join(value).encode() if unit == "char" else _value(value)  # a text, or a list of letters
    return values


def _value(value: Any) -> Any:
    """Convert a JSON value to a number, or a list of numbers; convert names of enumerations and flags too."""
    if isinstance(value, list):
        return [_value(part) for part in value]
    if isinstance(value, dict):
        return value["bits"] if "bits" in value else _value(value["type"])
    if isinstance(value, str):
        flags = [part.strip() for part in value.split("|") if part.strip()]
        return functools.reduce(operator.or_, (getattr(dialect(), flag) for flag in flags), 0)
    return math.nan if value is None else value
