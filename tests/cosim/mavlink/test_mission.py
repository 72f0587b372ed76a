"""Missions of regions: transfer, meaning, and progress."""

import math

import pytest
from pymavlink.dialects.v20 import all as mavlink

from cosim.simulation.commands.commands import (
    ChangeSetting,
    MissionItem,
    SetCurrentItem,
    SetHeading,
    SetMission,
    SetMode,
)
from tests.cosim.mavlink.station import ACCEPTED, DENIED, FAILED, NAN, Station, long, scenario, set_parameter
from tests.cosim.mavlink.stubs import message

LOCAL, GLOBAL, RELATIVE, GLOBAL_INT, RELATIVE_INT, TERRAIN = 1, 0, 3, 5, 6, 10
LATITUDE, LONGITUDE = 559_097_000, -33_203_000  # of the origin
WAYPOINT, FOREVER, FOR_TIME, HOME, LAND = 16, 17, 19, 20, 21
SPLINE, DELAY, WAIT, YAW, JUMP, SPEED = 82, 93, 112, 115, 177, 178
COUNT, LIST = mavlink.MAVLink_mission_count_message, mavlink.MAVLink_mission_request_list_message
OK = mavlink.MAV_MISSION_ACCEPTED


@pytest.fixture
def station(each_station):
    return each_station


def first(station):
    return int(station.profile.has_home_item)


def item(seq, frame=LOCAL, command=WAYPOINT, numbers=(0.0, 0.0, 0.0, NAN), place=(10_000, 20_000, 3.0), kind=0):
    return mavlink.MAVLink_mission_item_int_message(1, 1, seq, frame, command, 0, 1, *numbers, *place, kind)


def upload(station, *items, **who):
    """Upload as stations do, with home first where that is the way, until it is accepted or refused; return which."""
    items = [{}] * first(station) + list(items)
    replies = station.send(COUNT(1, 1, len(items), 0), **who)
    for seq, fields in enumerate(items):
        if replies and replies[-1].get_type() == "MISSION_ACK":
            break
        (request,) = [r for r in replies if r.get_type() == "MISSION_REQUEST_INT"]
        assert (request.seq, request.target_system, request.target_component) == (seq, who.get("system", 255), 190)
        replies = station.send(item(seq, **fields), **who)
    return result(replies)


def result(replies):
    """Return the type of the one MISSION_ACK."""
    (ack,) = [r for r in replies if r.get_type() == "MISSION_ACK"]
    return ack.type


def count(station, kind=0):
    (reply,) = station.send(LIST(1, 1, kind))
    assert reply.mission_type == kind
    return reply.count


GLOBE = {"place": (LATITUDE, LONGITUDE, -2.0)}


def test_mission_round_trips(station):
    items = [
        {"numbers": (5.0, 1.5, 7.0, 0.25), "place": (12_345, -54_321, 2.5)},
        {"command": FOR_TIME, "numbers": (9.0, 0.0, 0.0, NAN), "frame": RELATIVE_INT, **GLOBE},
        {"command": FOREVER, "frame": GLOBAL, "place": (LATITUDE + 100, LONGITUDE - 100, -2.0)},
    ]
    assert upload(station, *items) == OK and count(station) == 3 + first(station)
    for seq, fields in enumerate(items, first(station)):
        (back,) = station.send(message("MISSION_REQUEST_INT", 1, seq=seq, mission_type=0))
        sent = item(seq, **fields)
        names = ("seq", "frame", "command", "autocontinue", *(f"param{i}" for i in range(1, 5)), "x", "y", "z")
        expected = [getattr(sent, name) for name in names]
        assert [getattr(back, name) for name in names] == pytest.approx(expected, rel=0.0, abs=0.0, nan_ok=True)
        (old,) = station.send(message("MISSION_REQUEST", 1, seq=seq, mission_type=0))
        scale = 1e4 if back.frame == LOCAL else 1e7
        assert old.get_type() == "MISSION_ITEM" and old.x * scale == pytest.approx(back.x, rel=1e-6, abs=100)


MISSION = {"frame": 2, "place": (0, 0, 0.0)}  # MAV_FRAME_MISSION
# an item as it is sent, and what it means; the jumps go to the item with the number 2
MEANINGS = [
    ({"numbers": (5.0, 1.5, 0.0, NAN)}, MissionItem((1.0, 2.0, 3.0), 1.5, 5.0)),
    ({"numbers": (NAN, 0.0, 0.0, NAN), "frame": RELATIVE_INT, **GLOBE}, MissionItem((0.0, 0.0, 2.0), None, 0.0)),
    ({"command": FOR_TIME, "numbers": (9.0, 0.0, 0.0, NAN), "frame": GLOBAL_INT, **GLOBE},
     MissionItem((0.0, 0.0, 2.0), None, 9.0)),
    ({"command": FOREVER, "place": (30_000, 40_000, 6.0)}, MissionItem((3.0, 4.0, 6.0), None, None)),
    ({"command": LAND, "place": (0, 0, 0.0)}, MissionItem((3.0, 4.0, 0.5), 0.3, None)),  # above the one before
    ({"command": LAND, "place": (70_000, 80_000, 0.0)}, MissionItem((7.0, 8.0, 0.5), 0.3, None)),
    ({"command": HOME, **MISSION}, MissionItem((0.0, 0.0, 0.5), 0.3, None)),
    # as QGroundControl's settings of a mission
    ({"command": SPEED, "numbers": (1.0, 0.3, -1.0, 0.0), **MISSION},
     MissionItem(None, commands=(ChangeSetting("law.gains.speed", 0.3),))),
    ({"command": SPEED, "numbers": (1.0, -1.0, -1.0, 0.0), **MISSION}, MissionItem(None)),
    ({"command": SPLINE, "numbers": (4.0, 0.0, 0.0, 0.0)}, MissionItem((1.0, 2.0, 3.0), None, 4.0)),
    ({"command": DELAY, "numbers": (5.0, -1.0, -1.0, -1.0), **MISSION}, MissionItem(None, stay=5.0)),
    ({"command": WAIT, "numbers": (6.0, 0.0, 0.0, 0.0), **MISSION}, MissionItem(None, stay=6.0)),
    ({"command": YAW, "numbers": (90.0, 0.0, 1.0, 0.0), **MISSION},
     MissionItem(None, commands=(SetHeading(math.pi / 2),))),
    ({"command": JUMP, "numbers": (2.0, 3.0, 0.0, 0.0), **MISSION}, MissionItem(None, jump=2, times=3)),
    ({"command": JUMP, "numbers": (2.0, -1.0, NAN, NAN), "frame": 2, "place": (0, 0, NAN)},
     MissionItem(None, jump=2, times=None)),
    ({"command": LAND, "place": (0, 0, 0.0)}, MissionItem((1.0, 2.0, 0.5), 0.3, None)),
]  # fmt: skip


def test_mission_items_are_decoded(station):
    sent = [dict(fields) for fields, _ in MEANINGS]
    for fields in sent:
        if fields.get("command") == JUMP:
            fields["numbers"] = (2.0 + first(station), *fields["numbers"][1:])
    assert upload(station, *sent) == OK
    assert station.commanded() == [SetMission(tuple(meaning for _, meaning in MEANINGS))]
    (back,) = station.send(message("MISSION_REQUEST", 1, seq=13 + first(station), mission_type=0))
    assert (back.command, back.frame, back.param1, back.x) == (JUMP, 2, 2.0 + first(station), 0.0)


def test_speed_item_is_rejected_for_a_law_without_speed():
    station = Station("px4", of=scenario(name="paper"))
    station.look()
    assert upload(station, {"command": SPEED, "numbers": (1, 0.5, -1, 0)}) == mavlink.MAV_MISSION_UNSUPPORTED


def test_invalid_item_is_rejected_on_receipt_by_name(station):
    station.send(COUNT(1, 1, 4 + first(station), 0))
    for seq in range(1 + first(station)):
        station.send(item(seq))
    seq = 1 + first(station)  # QGroundControl names the item that it sent last
    assert result(station.send(item(seq, command=201))) == mavlink.MAV_MISSION_UNSUPPORTED
    assert station.wire.texts == [f"Refused: mission item {seq}: command 201 DO_SET_ROI is not known in a mission"]
    assert result(station.send(item(seq + 1))) == mavlink.MAV_MISSION_ERROR  # it is over


def test_mission_speed_updates_the_parameter(station):
    upload(station, {}, {"command": SPEED, "numbers": (1, 0.25, -1, 0)}, {})
    for now in (0.0, 2.0):  # the step of item 1 was not seen
        station.play({"commands.mode": 3.0, "commands.item": now})
    (value,) = station.send(message("PARAM_REQUEST_READ", 1, param_id=b"LAW_SPEED", param_index=-1))
    assert value.param_value == 0.25
    assert [m.seq for m in station.wire.of("MISSION_ITEM_REACHED")] == [first(station)]  # nor is it reported
    station.commanded()
    station.play(set_parameter("LAW_SPEED", 1.0), [ChangeSetting("law.gains.speed", 1.0)])


INVALID = {
    "UNSUPPORTED": [{"command": 22}],
    "UNSUPPORTED_FRAME": [{"frame": TERRAIN}],
    "INVALID_PARAM1": [
        {"numbers": (-1.0, 0, 0, 0)}, {"numbers": (math.inf, 0, 0, 0)}, {"command": YAW, "numbers": (NAN, 0, 0, 0)},
        {"command": DELAY, "numbers": (-1, 0, 0, 0)}, {"command": JUMP, "numbers": (9, 1, 0, 0)},
        {"command": JUMP, "numbers": (-1, 1, 0, 0)}],
    "INVALID_PARAM2": [
        {"numbers": (0, -1.0, 0, 0)}, {"command": SPEED, "numbers": (1, NAN, -1, 0)},
        {"command": SPEED, "numbers": (1, 0.0, -1, 0)}, {"command": JUMP, "numbers": (1, NAN, 0, 0)}],
    "INVALID_PARAM4": [{"command": YAW, "numbers": (90, 0, 1, 1)}],
    "INVALID_PARAM5_X": [{"frame": RELATIVE_INT, "place": (0, LONGITUDE, -4.0)}],
    "INVALID_PARAM6_Y": [{"frame": RELATIVE_INT, "place": (LATITUDE, 0, -4.0)}],
    "INVALID_PARAM7": [{"place": (0, 0, 1e6)}, {"place": (0, 0, NAN)}],
}  # fmt: skip


def test_invalid_mission_is_rejected_and_the_old_one_kept(station):
    upload(station, {})
    station.commanded()
    for name, fields in ((name, fields) for name, several in INVALID.items() for fields in several):
        assert upload(station, {}, fields) == getattr(mavlink, f"MAV_MISSION_{name}"), fields
        assert station.commanded() == [] and count(station) == 1 + first(station)


def test_deprecated_float_mission_items_are_accepted():
    station = Station("generic")
    station.play({}, COUNT(1, 1, 1, 0))
    old = mavlink.MAVLink_mission_item_message(1, 1, 0, LOCAL, WAYPOINT, 0, 1, 0, 2.0, 0, 0, 1.5, -2.5, 4.0, 0)
    assert result(station.send(old)) == OK
    assert station.commanded() == [SetMission((MissionItem((1.5, -2.5, 4.0), 2.0, 0.0),))]


def test_home_is_the_first_item_for_ardupilot():
    station = Station("ardusub")
    station.look()
    upload(station, {})
    (home,) = station.send(message("MISSION_REQUEST_INT", 1, seq=0, mission_type=0))
    assert (home.command, home.x, home.y, home.z) == (WAYPOINT, LATITUDE, LONGITUDE, 0.0)


def test_fences_and_rally_points_are_empty(station):
    clear = mavlink.MAVLink_mission_clear_all_message
    for kind in (1, 2):
        assert count(station, kind) == 0
        (ack,) = station.send(COUNT(1, 1, 2, kind))
        assert (ack.type, ack.mission_type) == (mavlink.MAV_MISSION_UNSUPPORTED, kind)
        assert result(station.send(clear(1, 1, kind))) == OK
    assert result(station.send(LIST(1, 1, 9))) == mavlink.MAV_MISSION_UNSUPPORTED
    assert station.commanded() == []


def test_missing_item_is_requested_again_until_timeout(station):
    station.send(COUNT(1, 1, 3, 0))
    station.wire.clear()
    station.wait(4.5, 0.5)
    assert {r.seq for r in station.wire.of("MISSION_REQUEST_INT")} == {0}
    station.play(item(0), item(0))  # twice: once is enough
    station.wire.clear()
    station.wait(10.0, 0.5)
    assert [r.seq for r in station.wire.of("MISSION_REQUEST_INT")] == [1] * 5
    assert result(station.wire.got) == mavlink.MAV_MISSION_OPERATION_CANCELLED
    assert upload(station, {}) == OK


def test_upload_can_be_canceled(station):
    station.play(COUNT(1, 1, 3, 0))
    assert station.wire.of("MISSION_REQUEST_INT")
    station.play(message("MISSION_ACK", 1, type=mavlink.MAV_MISSION_OPERATION_CANCELLED))
    station.wire.clear()
    station.wait(3.0, 0.5)
    assert station.wire.of("MISSION_REQUEST_INT") == []


def test_too_long_and_concurrent_uploads_are_rejected(station):
    assert result(station.send(COUNT(1, 1, 501, 0))) == mavlink.MAV_MISSION_NO_SPACE
    station.send(COUNT(1, 1, 3, 0))
    (ack,) = station.send(COUNT(1, 1, 1, 0), system=250)
    assert (ack.type, ack.target_system) == (mavlink.MAV_MISSION_DENIED, 250)


def test_mission_can_be_cleared(station):
    upload(station, {})
    assert result(station.send(mavlink.MAVLink_mission_clear_all_message(1, 1, 255))) == OK
    assert station.commanded()[-1] == SetMission(()) and count(station) == 0


def test_mission_start_and_set_current_are_applied(station):
    station.play((long(300, 0.0), FAILED))  # there is no mission yet
    upload(station, {}, {}, {})
    station.commanded()
    station.play(
        (long(300, 0.0, 0.0), ACCEPTED), (long(224, 2.0 + first(station)), ACCEPTED),
        message("MISSION_SET_CURRENT", 1, seq=1 + first(station)),
        [SetCurrentItem(0), SetMode("mission"), SetCurrentItem(2), SetCurrentItem(1)],
        (long(224, 3.0 + first(station)), DENIED), (long(224, NAN), DENIED),
    )  # fmt: skip


def test_mission_progress_is_reported(station):
    upload(station, {}, {})
    seq = first(station)
    for mode, now, clearance, state, at, passed in (
        (2.0, -1.0, -3.0, "NOT_STARTED", 0, []), (3.0, 0.0, -3.0, "ACTIVE", seq, []),
        (3.0, 1.0, -3.0, "ACTIVE", seq + 1, [seq]), (3.0, 1.0, 0.1, "COMPLETE", seq + 1, [seq + 1]),
        (1.0, 1.0, 0.1, "PAUSED", seq + 1, []),
    ):  # fmt: skip
        station.wire.clear()
        station.play({"commands.mode": mode, "commands.item": now, "goal.clearance": clearance})
        reached = [m.seq for m in station.wire.of("MISSION_ITEM_REACHED")]
        (current,) = station.request(42)
        expected = (getattr(mavlink, f"MISSION_STATE_{state}"), at, 2, passed)
        assert (current.mission_state, current.seq, current.total, reached) == expected


def test_read_only_rejects_missions():
    assert result(Station(commands=False).send(COUNT(1, 1, 1, 0))) == mavlink.MAV_MISSION_DENIED
