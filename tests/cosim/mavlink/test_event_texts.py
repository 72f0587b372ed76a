"""Status texts of events, and the ground-station failsafe."""

import pytest
from pymavlink.dialects.v20 import all as mavlink

from cosim.simulation.commands.commands import Arm, SetMode
from tests.cosim.mavlink.station import Station

BEAT = mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4, 3)


def clearances(goal=-3.0, first=2.0, band=2.0):
    return {"goal.clearance": (goal, first, 2.0, band, 1e5, 1e5)}


def test_region_entry_and_exit_are_announced_with_hysteresis(station):
    station.look(1.0, **clearances(first=-0.005))  # not far enough in
    assert station.wire.texts == []
    station.look(1.1, **clearances(first=-0.02))
    station.look(1.2, **clearances(first=0.005))  # not far enough out
    station.look(1.3, **clearances(first=-0.02))
    station.look(1.4, **clearances(first=0.02))
    assert station.wire.texts == ["Region SR1 entered: keep out", "Region SR1 left"]
    assert [m.severity for m in station.wire.of("STATUSTEXT")] == [4, 6]


def test_chatter_at_a_boundary_is_rate_limited(station):
    for k in range(200):
        station.now += 0.01
        station.autopilot.tick(station.now)
        station.look(1.0 + 0.01 * k, **clearances(first=0.05 * (-1) ** k))
    assert len(station.wire.texts) <= 4


def test_target_reached_and_left_are_announced(station):
    station.look(1.0, **clearances(goal=0.1))
    station.look(2.0, **clearances(goal=-0.1))
    assert station.wire.texts == ["Target reached", "Target left"]


def test_saturation_is_announced(station):
    station.look(1.0, allocation_saturated=1.0)
    station.look(1.5)
    station.look(1.6, **{"thrust_saturated[3]": 1.0})
    station.look(2.5)
    station.look(2.7)
    assert station.wire.texts == ["Thrust saturated", "Thrust no longer saturated"]


def test_arming_and_bottom_contact_are_announced(station):
    station.look(1.0, **{"commands.armed": 0.0})
    station.look(1.1)
    station.look(1.2, bottom_contact=1.0)
    assert station.wire.texts == ["Disarmed", "Armed", "Bottom touched"]


def test_long_text_is_split_into_chunks(station):
    context = station.autopilot._context
    for length in (50, 51, 100, 101, 150, 500):
        station.wire.clear()
        station.now += 10.0
        station.autopilot.tick(station.now)
        station.wire.clear()
        context.send_text("x" * length)
        parts = station.wire.of("STATUSTEXT")
        assert "".join(part.text for part in parts) == "x" * min(length, 200)
        if length > 50:
            assert len({part.id for part in parts}) == 1 and parts[0].id > 0
            assert [part.chunk_seq for part in parts] == list(range(len(parts)))
            assert len(parts[-1].text) < 50  # which ends it
        else:
            assert parts[0].id == 0


def test_status_text_rate_is_limited_and_the_rest_is_sent_later(station):
    for k in range(30):
        station.autopilot._context.send_text(f"text {k}")
    assert len(station.wire.texts) == 12
    station.wait(3.0)
    assert station.wire.texts == [f"text {k}" for k in range(30)]


# ---- the watch ----


def commanding(action, **options):
    station = Station("ardusub", loss_action=action, **options)
    station.look(0.0)
    station.send(BEAT)
    station.command(400, 1.0)
    station.commanded()
    station.wire.clear()
    return station


@pytest.mark.slow
@pytest.mark.parametrize(
    ("action", "commands"),
    [("warn", []), ("hold", [SetMode("hold")]), ("surface", [SetMode("surface")]), ("disarm", [Arm(False)])],
)
def test_silent_station_triggers_the_loss_action(action, commands):
    station = commanding(action)
    station.wait(4.9)
    assert station.commanded() == [] and not any("lost" in text for text in station.wire.texts)
    station.wait(0.3)
    assert station.commanded() == commands
    assert any(text.startswith("Link to station 255 lost") for text in station.wire.texts)
    station.command(512, 0)
    assert station.wire.of("HEARTBEAT")[-1].system_status == mavlink.MAV_STATE_CRITICAL
    station.wait(60.5)
    assert station.commanded() == []
    assert len([text for text in station.wire.texts if "lost" in text]) == 3  # every 30 s
    station.send(BEAT)
    station.wait(0.1)
    assert "Link to station 255 regained" in station.wire.texts
    station.command(512, 0)
    assert station.wire.of("HEARTBEAT")[-1].system_status == mavlink.MAV_STATE_ACTIVE


@pytest.mark.medium
def test_loss_action_none_does_nothing():
    station = commanding("none")
    station.wait(100.0, 0.5)
    assert not any("lost" in text for text in station.wire.texts) and station.commanded() == []


def test_only_loss_of_a_commanding_station_triggers_the_action():
    station = Station("ardusub", loss_action="disarm")
    station.look(0.0)
    station.send(BEAT, system=250)  # never commands
    station.command(400, 1.0)  # never sends a heartbeat
    station.commanded()
    station.wait(60.0, 0.5)
    assert station.commanded() == []
    station.send(BEAT)
    station.wait(4.0)
    station.send(BEAT)
    station.wait(4.0)
    assert station.commanded() == []
    station.wait(2.0)
    assert station.commanded() == [Arm(False)]


@pytest.mark.medium
def test_loss_timeout_uses_wall_clock_time():
    station = commanding("disarm")
    for k in range(200):
        station.look(5.0 * k)
    station.wait(1.0)
    assert station.commanded() == []


def test_failsafe_timeout_and_action_are_parameters():
    station = commanding("warn")
    for name, value in ((b"FS_GCS_TIMEOUT", 20.0), (b"FS_GCS_ENABLE", 2.0)):
        station.send(mavlink.MAVLink_param_set_message(1, 1, name, value, 9))
    station.send(BEAT)
    station.wait(19.0)
    assert station.commanded() == []
    station.wait(2.0)
    assert station.commanded() == [Arm(False)]


def test_an_action_that_finds_the_queue_full_is_tried_again():
    station = commanding("disarm")
    while station.commands.submit(Arm(True)):
        pass
    station.wait(6.0)
    assert Arm(False) not in station.commanded()
    station.wait(0.1)
    assert station.commanded() == [Arm(False)]


def test_time_messages_are_answered(station):
    station.look(2.5)
    station.wire.clear()
    (reply,) = station.send(mavlink.MAVLink_timesync_message(0, 987))
    assert (reply.tc1, reply.ts1) == (2_500_000_000, 987)
    assert station.send(mavlink.MAVLink_timesync_message(1, 987)) == []
    (ping,) = station.send(mavlink.MAVLink_ping_message(5, 6, 0, 0))
    assert (ping.time_usec, ping.seq, ping.target_system, ping.target_component) == (5, 6, 255, 190)
    assert station.send(mavlink.MAVLink_ping_message(5, 6, 1, 1)) == []


def test_requests_of_logs_are_answered_at_once_with_none(station):
    """MAVSDK waits 7.5 s without an answer."""
    (entry,) = station.send(mavlink.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF))
    assert (entry.get_type(), entry.num_logs, entry.last_log_num, entry.size) == ("LOG_ENTRY", 0, 0, 0)
    data = station.send(mavlink.MAVLink_log_request_data_message(1, 1, 7, 90, 1000))[0]
    assert (data.get_type(), data.id, data.ofs, data.count) == ("LOG_DATA", 7, 90, 0)
    assert any("no log 7" in text for text in station.wire.texts)
    station.send(mavlink.MAVLink_log_erase_message(1, 1))
    station.wait(2.1)
    assert "Refused: there are no logs to erase" in station.wire.texts
