"""Missions of regions: transfer, meaning, and progress."""

import math

import pytest
from pymavlink.dialects.v20 import all as mavlink

from cosim.simulation.commands.commands import (  # fmt: skip
    ChangeSetting,
    MissionItem,
    SetCurrentItem,
    SetHeading,
    SetMission,
    SetMode,
)
from tests.cosim.mavlink.station import NAN, Station, scenario

LOCAL, GLOBAL, RELATIVE, GLOBAL_INT, RELATIVE_INT, TERRAIN = 1, 0, 3, 5, 6, 10
LATITUDE, LONGITUDE = 559_097_000, -33_203_000  # of the origin
WAYPOINT, FOREVER, FOR_TIME, HOME, LAND = 16, 17, 19, 20, 21
SPLINE, DELAY, WAIT, YAW, JUMP, SPEED = 82, 93, 112, 115, 177, 178


@pytest.fixture(params=["ardusub", "px4", "generic"])
def station(request):
    station = Station(request.param)
    station.look()
    return station


def first(station):
    return int(station.profile.has_home_item)


def item(seq, frame=LOCAL, command=WAYPOINT, numbers=(0.0, 0.0, 0.0, NAN), place=(10_000, 20_000, 3.0), kind=0):
    return mavlink.MAVLink_mission_item_int_message(1, 1, seq, frame, command, 0, 1, *numbers, *place, kind)


def upload(station, *items, **who):
    """Upload as stations do, with home first where that is the way, until it is accepted or refused; return which."""
    items = [{}, *items] if first(station) else list(items)
    replies = station.send(mavlink.MAVLink_mission_count_message(1, 1, len(items), 0), **who)
    for seq, fields in enumerate(items):
        if replies and replies[-1].get_type() == "MISSION_ACK":
            break
        (asked,) = [r for r in replies if r.get_type() == "MISSION_REQUEST_INT"]
        assert (asked.seq, asked.target_system, asked.target_component) == (seq, who.get("system", 255), 190)
        replies = station.send(item(seq, **fields), **who)
    (ack,) = [r for r in replies if r.get_type() == "MISSION_ACK"]
    return ack.type


def test_mission_round_trips(station):
    items = [
        {"numbers": (5.0, 1.5, 7.0, 0.25), "place": (12_345, -54_321, 2.5)},
        {"command": FOR_TIME, "numbers": (9.0, 0.0, 0.0, NAN), "frame": RELATIVE_INT, **GLOBE},
        {"command": FOREVER, "frame": GLOBAL, "place": (LATITUDE + 100, LONGITUDE - 100, -2.0)},
    ]
    assert upload(station, *items) == mavlink.MAV_MISSION_ACCEPTED
    (count,) = station.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    assert (count.count, count.mission_type) == (3 + first(station), 0)
    for i, fields in enumerate(items):
        (back,) = station.send(mavlink.MAVLink_mission_request_int_message(1, 1, i + first(station), 0))
        sent = item(i + first(station), **fields)
        for name in ("seq", "frame", "command", "autocontinue", "param1", "param2", "param3", "x", "y", "z"):
            assert getattr(back, name) == getattr(sent, name)
        assert back.param4 == sent.param4 or (math.isnan(back.param4) and math.isnan(sent.param4))
        (old,) = station.send(mavlink.MAVLink_mission_request_message(1, 1, i + first(station), 0))
        scale = 1e4 if back.frame == LOCAL else 1e7
        assert old.get_type() == "MISSION_ITEM" and old.x * scale == pytest.approx(back.x, rel=1e-6, abs=100)


MISSION = {"frame": 2, "place": (0, 0, 0.0)}  # MAV_FRAME_MISSION
GLOBE = {"place": (LATITUDE, LONGITUDE, -2.0)}
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
    assert upload(station, *sent) == mavlink.MAV_MISSION_ACCEPTED
    assert station.commanded() == [SetMission(tuple(meaning for _, meaning in MEANINGS))]
    (back,) = station.send(mavlink.MAVLink_mission_request_message(1, 1, 13 + first(station), 0))
    assert (back.command, back.frame, back.param1, back.x) == (JUMP, 2, 2.0 + first(station), 0.0)


def test_speed_item_is_rejected_for_a_law_without_speed():
    station = Station("px4", of=scenario(name="paper"))
    station.look()
    assert upload(station, {"command": SPEED, "numbers": (1, 0.5, -1, 0)}) == mavlink.MAV_MISSION_UNSUPPORTED


def test_invalid_item_is_rejected_on_receipt_by_name(station):
    items = [{}, {"command": 201}, {}, {}]  # QGroundControl names the item that it sent last
    station.send(mavlink.MAVLink_mission_count_message(1, 1, 4 + first(station), 0))
    for seq in range(1 + first(station)):
        station.send(item(seq))
    *texts, ack = station.send(item(1 + first(station), **items[1]))
    assert ack.type == mavlink.MAV_MISSION_UNSUPPORTED
    text = "".join(part.text for part in texts)
    assert text == f"Refused: mission item {1 + first(station)}: command 201 DO_SET_ROI is not known in a mission"
    assert station.send(item(2 + first(station)))[-1].type == mavlink.MAV_MISSION_ERROR  # it is over


def test_mission_speed_updates_the_parameter(station):
    upload(station, {}, {"command": SPEED, "numbers": (1, 0.25, -1, 0)}, {})
    for item in (0.0, 2.0):  # the step of item 1 was not seen
        station.look(1.0 + item, **{"commands.mode": 3.0, "commands.item": item})
    (value,) = station.send(mavlink.MAVLink_param_request_read_message(1, 1, b"LAW_SPEED", -1))
    assert value.param_value == 0.25
    assert [m.seq for m in station.wire.of("MISSION_ITEM_REACHED")] == [first(station)]  # nor is it reported
    station.commanded()
    station.send(mavlink.MAVLink_param_set_message(1, 1, b"LAW_SPEED", 1.0, 9))
    assert station.commanded() == [ChangeSetting("law.gains.speed", 1.0)]


@pytest.mark.medium(fast=11)
@pytest.mark.parametrize(
    ("fields", "result"),
    [
        ({"command": 22}, mavlink.MAV_MISSION_UNSUPPORTED),
        ({"frame": TERRAIN}, mavlink.MAV_MISSION_UNSUPPORTED_FRAME),
        ({"numbers": (-1.0, 0, 0, 0)}, mavlink.MAV_MISSION_INVALID_PARAM1),
        ({"numbers": (0, -1.0, 0, 0)}, mavlink.MAV_MISSION_INVALID_PARAM2),
        ({"numbers": (math.inf, 0, 0, 0)}, mavlink.MAV_MISSION_INVALID_PARAM1),
        ({"frame": RELATIVE_INT, "place": (0, LONGITUDE, -4.0)}, mavlink.MAV_MISSION_INVALID_PARAM5_X),
        ({"frame": RELATIVE_INT, "place": (LATITUDE, 0, -4.0)}, mavlink.MAV_MISSION_INVALID_PARAM6_Y),
        ({"place": (0, 0, 1e6)}, mavlink.MAV_MISSION_INVALID_PARAM7),
        ({"place": (0, 0, NAN)}, mavlink.MAV_MISSION_INVALID_PARAM7),
        ({"command": SPEED, "numbers": (1, NAN, -1, 0)}, mavlink.MAV_MISSION_INVALID_PARAM2),
        ({"command": SPEED, "numbers": (1, 0.0, -1, 0)}, mavlink.MAV_MISSION_INVALID_PARAM2),
        ({"command": YAW, "numbers": (90, 0, 1, 1)}, mavlink.MAV_MISSION_INVALID_PARAM4),
        ({"command": YAW, "numbers": (NAN, 0, 0, 0)}, mavlink.MAV_MISSION_INVALID_PARAM1),
        ({"command": DELAY, "numbers": (-1, 0, 0, 0)}, mavlink.MAV_MISSION_INVALID_PARAM1),
        ({"command": JUMP, "numbers": (9, 1, 0, 0)}, mavlink.MAV_MISSION_INVALID_PARAM1),
        ({"command": JUMP, "numbers": (-1, 1, 0, 0)}, mavlink.MAV_MISSION_INVALID_PARAM1),
        ({"command": JUMP, "numbers": (1, NAN, 0, 0)}, mavlink.MAV_MISSION_INVALID_PARAM2),
    ],
)
def test_invalid_mission_is_rejected_and_the_old_one_kept(station, fields, result):
    upload(station, {})
    station.commanded()
    assert upload(station, {}, fields) == result
    assert station.commanded() == []
    (count,) = station.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    assert count.count == 1 + first(station)  # the mission before is still there


def test_deprecated_float_mission_items_are_accepted():
    station = Station("generic")
    station.look()
    station.send(mavlink.MAVLink_mission_count_message(1, 1, 1, 0))
    old = mavlink.MAVLink_mission_item_message(1, 1, 0, LOCAL, WAYPOINT, 0, 1, 0, 2.0, 0, 0, 1.5, -2.5, 4.0, 0)
    (ack,) = station.send(old)
    assert ack.type == mavlink.MAV_MISSION_ACCEPTED
    assert station.commanded() == [SetMission((MissionItem((1.5, -2.5, 4.0), 2.0, 0.0),))]


def test_home_is_the_first_item_for_ardupilot():
    station = Station("ardusub")
    station.look()
    upload(station, {})
    (home,) = station.send(mavlink.MAVLink_mission_request_int_message(1, 1, 0, 0))
    assert (home.command, home.x, home.y, home.z) == (WAYPOINT, LATITUDE, LONGITUDE, 0.0)


def test_fences_and_rally_points_are_empty(station):
    for kind in (1, 2):
        (count,) = station.send(mavlink.MAVLink_mission_request_list_message(1, 1, kind))
        assert (count.count, count.mission_type) == (0, kind)
        (ack,) = station.send(mavlink.MAVLink_mission_count_message(1, 1, 2, kind))
        assert (ack.type, ack.mission_type) == (mavlink.MAV_MISSION_UNSUPPORTED, kind)
        (ack,) = station.send(mavlink.MAVLink_mission_clear_all_message(1, 1, kind))
        assert ack.type == mavlink.MAV_MISSION_ACCEPTED
    (ack,) = station.send(mavlink.MAVLink_mission_request_list_message(1, 1, 9))
    assert ack.type == mavlink.MAV_MISSION_UNSUPPORTED
    assert station.commanded() == []


def test_missing_item_is_requested_again_until_timeout(station):
    station.send(mavlink.MAVLink_mission_count_message(1, 1, 3, 0))
    station.wire.clear()
    station.wait(4.5, 0.5)
    assert {r.seq for r in station.wire.of("MISSION_REQUEST_INT")} == {0}
    station.send(item(0))
    station.send(item(0))  # twice: once is enough
    station.wire.clear()
    station.wait(10.0, 0.5)
    assert [r.seq for r in station.wire.of("MISSION_REQUEST_INT")] == [1] * 5
    assert [a.type for a in station.wire.of("MISSION_ACK")] == [mavlink.MAV_MISSION_OPERATION_CANCELLED]
    assert upload(station, {}) == mavlink.MAV_MISSION_ACCEPTED


def test_upload_can_be_canceled(station):
    station.send(mavlink.MAVLink_mission_count_message(1, 1, 3, 0))
    station.send(mavlink.MAVLink_mission_ack_message(1, 1, mavlink.MAV_MISSION_OPERATION_CANCELLED, 0))
    station.wire.clear()
    station.wait(3.0, 0.5)
    assert station.wire.of("MISSION_REQUEST_INT") == []


def test_too_long_and_concurrent_uploads_are_rejected(station):
    (ack,) = station.send(mavlink.MAVLink_mission_count_message(1, 1, 501, 0))
    assert ack.type == mavlink.MAV_MISSION_NO_SPACE
    station.send(mavlink.MAVLink_mission_count_message(1, 1, 3, 0))
    (ack,) = station.send(mavlink.MAVLink_mission_count_message(1, 1, 1, 0), system=250)
    assert (ack.type, ack.target_system) == (mavlink.MAV_MISSION_DENIED, 250)


def test_mission_can_be_cleared(station):
    upload(station, {})
    (ack,) = station.send(mavlink.MAVLink_mission_clear_all_message(1, 1, 255))
    assert ack.type == mavlink.MAV_MISSION_ACCEPTED
    assert station.commanded()[-1] == SetMission(())
    (count,) = station.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    assert count.count == 0


def test_mission_start_and_set_current_are_applied(station):
    assert station.command(300, 0.0) == mavlink.MAV_RESULT_FAILED  # there is no mission yet
    upload(station, {}, {}, {})
    station.commanded()
    assert station.command(300, 0.0, 0.0) == mavlink.MAV_RESULT_ACCEPTED
    assert station.command(224, 2.0 + first(station)) == mavlink.MAV_RESULT_ACCEPTED
    station.send(mavlink.MAVLink_mission_set_current_message(1, 1, 1 + first(station)))
    assert station.commanded() == [SetCurrentItem(0), SetMode("mission"), SetCurrentItem(2), SetCurrentItem(1)]
    assert station.command(224, 3.0 + first(station)) == mavlink.MAV_RESULT_DENIED
    assert station.command(224, NAN) == mavlink.MAV_RESULT_DENIED


def test_mission_progress_is_reported(station):
    upload(station, {}, {})
    seq = first(station)

    def current():
        return station.wire.of("MISSION_CURRENT")[-1]

    station.command(512, 42)
    assert (current().seq, current().total, current().mission_state) == (0, 2, mavlink.MISSION_STATE_NOT_STARTED)
    station.look(1.1, **{"commands.mode": 3.0, "commands.item": 0.0})
    station.command(512, 42)
    assert (current().seq, current().mission_state) == (seq, mavlink.MISSION_STATE_ACTIVE)
    station.look(1.2, **{"commands.mode": 3.0, "commands.item": 1.0})
    assert [m.seq for m in station.wire.of("MISSION_ITEM_REACHED")] == [seq]
    station.look(1.3, **{"commands.mode": 3.0, "commands.item": 1.0, "goal.clearance": 0.1})
    station.command(512, 42)
    assert current().mission_state == mavlink.MISSION_STATE_COMPLETE
    assert [m.seq for m in station.wire.of("MISSION_ITEM_REACHED")] == [seq, seq + 1]
    station.look(1.4, **{"commands.mode": 1.0, "commands.item": 1.0})
    station.command(512, 42)
    assert current().mission_state == mavlink.MISSION_STATE_PAUSED


def test_read_only_rejects_missions():
    station = Station(commands=False)
    (ack,) = [
        r for r in station.send(mavlink.MAVLink_mission_count_message(1, 1, 1, 0)) if r.get_type() == "MISSION_ACK"
    ]
    assert ack.type == mavlink.MAV_MISSION_DENIED
