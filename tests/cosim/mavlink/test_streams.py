"""Messages on request, at an interval, and in groups."""

import math

import pytest
from pymavlink.dialects.v20 import all as mavlink

from cosim.mavlink.messages.message_table import message_specs
from cosim.mavlink.messages.streams import MAX_LOAD
from tests.cosim.mavlink.station import ACCEPTED, DENIED, FAILED, NAN, long
from tests.cosim.mavlink.stubs import message

SET, GET, ONCE = 511, 510, 512
ATTITUDE = 30


def run(station, seconds, step=0.01):
    """Count the messages of some simulated time."""
    start = station.context.view.boot_us / 1e6
    station.wire.clear()
    for k in range(1, round(seconds / step) + 1):
        station.look(start + step * k)
    return station.wire.counts()


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize(
    ("interval", "count"),
    [(20_000, 500), (15_000, 667), (33_333, 300), (1_000_000, 10), (1, 1000), (9_999, 1000), (-1, 0)],
)
def test_requested_interval_is_kept_exactly(station, interval, count):
    assert station.command(SET, ATTITUDE, interval) == ACCEPTED
    assert run(station, 10.0)["ATTITUDE"] == pytest.approx(count, abs=1 if count else 0)


@pytest.mark.medium
def test_interval_does_not_drift_with_unaligned_steps(station):
    station.command(SET, ATTITUDE, 25_000)
    run(station, 60.0, step=0.007)
    times = [m.time_boot_ms for m in station.wire.of("ATTITUDE")]
    assert len(times) == pytest.approx(2400, abs=1)
    assert all(0 <= time % 25 <= 7 for time in times)  # always the first snapshot once it is due


def test_missed_steps_send_no_burst(station):
    station.look(100.0)
    assert station.wire.counts()["ATTITUDE"] == 1


def test_interval_returns_to_default(station):
    station.play((long(SET, ATTITUDE, 500_000), ACCEPTED), (long(SET, ATTITUDE, 0), ACCEPTED))
    assert run(station, 5.0)["ATTITUDE"] == 50


def test_message_interval_is_reported(station):
    station.command(SET, ATTITUDE, 50_000)
    for number, result, interval in (
        ((GET, ATTITUDE), ACCEPTED, 50_000), ((ONCE, 244, ATTITUDE), ACCEPTED, 50_000), ((GET, 331), ACCEPTED, -1),
        ((GET, 9999), FAILED, 0),
    ):  # fmt: skip
        assert station.command(*number) == result
        reply = station.wire.of("MESSAGE_INTERVAL")[-1]
        assert (reply.message_id, reply.interval_us) == (number[-1], interval)


@pytest.mark.parametrize(
    "numbers", [(9999, 100_000), (NAN, 100_000), (ATTITUDE, NAN), (math.inf, 1), (-1, 1), (397, 1)]
)
def test_interval_of_an_unknown_message_is_rejected(station, numbers):
    assert station.command(SET, *numbers) in (DENIED, FAILED)


@pytest.mark.medium
def test_stream_load_per_link_is_bounded(station):
    results = [station.command(SET, message_id, 1) for message_id in message_specs()]
    assert DENIED in results and results[0] == ACCEPTED
    assert station.autopilot._streams[station.wire].load <= MAX_LOAD
    run(station, 1.0)
    assert sum(12 + len(m.get_payload()) for m in station.wire.got) <= MAX_LOAD


def test_every_listed_message_can_be_requested_and_no_other(station):
    near = {"altitude": 3.0, "measured.altitude": 3.0, "goal.clearance": (-3.0, 2.0, 2.0, 2.0, 3.0, 3.0)}
    station.look(1.0, **near)
    for message_id in message_specs():
        station.wire.clear()
        assert station.command(ONCE, message_id) == ACCEPTED
        assert set(station.wire.counts()) == {"COMMAND_ACK", mavlink.mavlink_map[message_id].msgname}
    station.play(*((long(ONCE, number), FAILED) for number in (140, 300, 395, 396, 397, 410, 9999, -5, NAN)))


def group(number, rate, start=1):
    return message("REQUEST_DATA_STREAM", 1, req_stream_id=number, req_message_rate=rate, start_stop=start)


def test_stream_groups_set_their_messages(station):
    for start, rate in ((1, 100), (0, 0)):
        station.send(group(10, 25, start))
        counts = run(station, 4.0)
        assert counts["ATTITUDE"] == counts["AHRS2"] == rate and counts["ATTITUDE_QUATERNION"] == 40


def test_stream_all_request_of_mavproxy_sets_every_group(station):
    station.send(group(0, 4))
    counts = run(station, 10.0)
    for name in ("ATTITUDE", "VFR_HUD", "GLOBAL_POSITION_INT", "SYS_STATUS", "SERVO_OUTPUT_RAW", "SCALED_IMU2"):
        assert counts[name] == pytest.approx(40, abs=1)
    assert counts["HEARTBEAT"] == 10 and counts["HOME_POSITION"] == 10
    station.send(group(0, 0))
    assert run(station, 2.0)["ATTITUDE"] == 0


def test_seventeen_messages_at_50_hertz_are_accepted(station):
    ids = (1, 2, 24, 29, 30, 31, 32, 33, 36, 62, 74, 85, 137, 147, 242, 245, 178)
    station.play(*((long(SET, i, 20_000), ACCEPTED) for i in ids))
    counts = run(station, 2.0)
    assert all(counts[mavlink.mavlink_map[i].msgname] == 100 for i in ids)


def test_version_and_banner_are_sent_on_request(station):
    station.play((long(520, 1.0), ACCEPTED), (long(42428), ACCEPTED))
    (version,), able = station.wire.of("AUTOPILOT_VERSION"), "MAV_PROTOCOL_CAPABILITY_"
    for name, has in (("MISSION_INT", True), ("FTP", True), ("MISSION_FENCE", False)):
        assert bool(version.capabilities & getattr(mavlink, able + name)) == has
    assert (version.vendor_id, version.product_id) == (0, 0) and version.uid
    assert station.wire.texts[0].startswith("subreach co-simulation")
