"""Status texts of events, and the ground-station failsafe."""

import pytest
from pymavlink.dialects.v20 import all as mavlink

from cosim.simulation.commands.commands import Arm, SetMode
from tests.cosim.mavlink.station import HEARTBEAT, Station, long, set_parameter
from tests.cosim.mavlink.stubs import message


def clearances(goal=-3.0, first=2.0, band=2.0):
    return {"goal.clearance": (goal, first, 2.0, band, 1e5, 1e5)}


# rows, each 0.1 s after the one before, with the messages received between; the texts of them all with their severities
EVENTS = {
    "a region is entered and left, with hysteresis": (
        [clearances(first=-0.005), None, clearances(first=-0.02), "entered", clearances(first=0.005), None,
         clearances(first=-0.02), clearances(first=0.02)],
        [(4, "Region SR1 entered: keep out"), (6, "Region SR1 left")]),
    "the target": ([clearances(goal=0.1), clearances(goal=-0.1)], [(6, "Target reached"), (6, "Target left")]),
    "saturation": (
        [{"allocation_saturated": 1.0}, *[{}] * 5, {"thrust_saturated[3]": 1.0}, *[{}] * 12],
        [(4, "Thrust saturated"), (6, "Thrust no longer saturated")]),
    "arming and the bottom": ([{"commands.armed": 0.0}, {}, {"bottom_contact": 1.0}],
                              [(5, "Disarmed"), (5, "Armed"), (4, "Bottom touched")]),
}  # fmt: skip


@pytest.mark.parametrize(("rows", "texts"), EVENTS.values(), ids=EVENTS)
def test_events_are_announced(station, rows, texts):
    station.play(*rows)
    assert [(text.severity, text.text) for text in station.wire.of("STATUSTEXT")] == texts


def test_the_end_of_saturation_is_announced_after_a_second(station):
    station.play({"allocation_saturated": 1.0}, "Thrust saturated", *[{}] * 9, None, *[{}] * 2, "no longer saturated")


def test_chatter_at_a_boundary_is_rate_limited(station):
    for k in range(200):
        station.now += 0.01
        station.autopilot.tick(station.now)
        station.look(1.0 + 0.01 * k, **clearances(first=0.05 * (-1) ** k))
    assert len(station.wire.texts) <= 4


def test_long_text_is_split_into_chunks(station):
    for length in (50, 51, 100, 101, 150, 500):
        station.wait(1.0)
        station.wire.clear()
        station.context.send_text("x" * length)
        parts = station.wire.of("STATUSTEXT")
        assert station.wire.texts == ["x" * min(length, 200)]
        if length > 50:
            assert len({part.id for part in parts}) == 1 and parts[0].id > 0
            assert [part.chunk_seq for part in parts] == list(range(len(parts)))
            assert len(parts[-1].text) < 50  # which ends it
        else:
            assert parts[0].id == 0


def test_status_text_rate_is_limited_and_the_rest_is_sent_later(station):
    for k in range(30):
        station.context.send_text(f"text {k}")
    assert len(station.wire.texts) == 12
    station.wait(3.0)
    assert station.wire.texts == [f"text {k}" for k in range(30)]


# ---- the watch ----


def commanding(action, **options):
    station = Station("ardusub", loss_action=action, **options)
    station.play({}, HEARTBEAT, (long(400, 1.0), 0), [Arm(True)])
    station.wire.clear()
    return station


@pytest.mark.slow
@pytest.mark.parametrize(
    ("action", "commands"),
    [("warn", []), ("hold", [SetMode("hold")]), ("surface", [SetMode("surface")]), ("disarm", [Arm(False)])],
)
def test_silent_station_triggers_the_loss_action(action, commands):
    station = commanding(action)
    station.play(4.9, [], None, 0.3, commands, "Link to station 255 lost")
    assert station.request(0)[-1].system_status == mavlink.MAV_STATE_CRITICAL
    station.play(60.5, [])
    assert len([text for text in station.wire.texts if "lost" in text]) == 2  # every 30 s
    station.play(HEARTBEAT, 0.1)
    assert station.wire.texts[-1] == "Link to station 255 regained"
    assert station.request(0)[-1].system_status == mavlink.MAV_STATE_ACTIVE


@pytest.mark.medium
def test_loss_action_none_does_nothing():
    station = commanding("none")
    station.wait(100.0, 0.5)
    station.play(None, [])


def test_only_loss_of_a_commanding_station_triggers_the_action():
    station = Station("ardusub", loss_action="disarm")
    station.look(0.0)
    station.send(HEARTBEAT, system=250)  # never commands
    station.play((long(400, 1.0), 0), [Arm(True)])  # never sends a heartbeat
    station.wait(60.0, 0.5)
    station.play([], HEARTBEAT, 4.0, HEARTBEAT, 4.0, [], 2.0, [Arm(False)])


def test_loss_timeout_uses_wall_clock_time():
    station = commanding("disarm")
    for k in range(200):
        station.look(5.0 * k)
    station.play(1.0, [])


def test_failsafe_timeout_and_action_are_parameters():
    station = commanding("warn")
    station.play(set_parameter("FS_GCS_TIMEOUT", 20.0), set_parameter("FS_GCS_ENABLE", 2.0))
    station.play(HEARTBEAT, 19.0, [], 2.0, [Arm(False)])


def test_an_action_that_finds_the_queue_full_is_tried_again():
    station = commanding("disarm")
    while station.commands.submit(Arm(True)):
        pass
    station.wait(6.0)
    assert Arm(False) not in station.commanded()
    station.play(0.1, [Arm(False)])


def test_time_messages_are_answered(station):
    station.look(2.5)
    (reply,) = station.send(message("TIMESYNC", ts1=987))
    assert (reply.tc1, reply.ts1) == (2_500_000_000, 987)
    assert station.send(message("TIMESYNC", tc1=1, ts1=987)) == []
    (ping,) = station.send(message("PING", time_usec=5, seq=6))
    assert (ping.time_usec, ping.seq, ping.target_system, ping.target_component) == (5, 6, 255, 190)
    assert station.send(message("PING", 1)) == []


def test_requests_of_logs_are_answered_at_once_with_none(station):
    """MAVSDK waits 7.5 s without an answer."""
    (entry,) = station.send(message("LOG_REQUEST_LIST", 1, end=0xFFFF))
    assert (entry.get_type(), entry.num_logs, entry.last_log_num, entry.size) == ("LOG_ENTRY", 0, 0, 0)
    data = station.send(message("LOG_REQUEST_DATA", 1, id=7, ofs=90))[0]
    assert (data.get_type(), data.id, data.ofs, data.count) == ("LOG_DATA", 7, 90, 0)
    station.play("no log 7", message("LOG_ERASE", 1), 2.1, "Refused: there are no logs to erase")
