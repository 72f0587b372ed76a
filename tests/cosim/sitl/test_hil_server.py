"""PX4's simulator interface, against a stand-in that packs and reads MAVLink 2 by hand."""

import functools
import itertools
import math
import socket
import struct

import numpy as np
import pytest

from cosim.errors import RunError
from cosim.mavlink.wire.dialect import dialect
from cosim.results.record import load_record
from cosim.sitl.hil_messages import FIELD_NED, RATE, hil_messages, pressure_at
from cosim.sitl.hil_server import LEFT, HilServer
from cosim.sitl.law import make_control_law
from cosim.sitl.motion import Motion

# id: extra byte of the checksum, and the payload's fields as they go over the wire
MESSAGES = {
    0: (50, "<IBBBBB"),
    93: (47, "<QQ16fB"),
    107: (108, "<Q13fIB"),
    113: (124, "<QiiiHHHhhhHBB"),
    115: (4, "<Q4f3fiiihhhHHhhh"),
}
ARMED = 128


def checksum(data):
    """CRC-16/MCRF4XX, as MAVLink has it."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x8408 if crc & 1 else 0)
    return crc


def packed(number, *values, sequence=0):
    extra, layout = MESSAGES[number]
    payload = struct.pack(layout, *values).rstrip(b"\0") or b"\0"
    frame = bytes([len(payload), 0, 0, sequence % 256, 1, 1]) + number.to_bytes(3, "little") + payload
    return b"\xfd" + frame + checksum(frame + bytes([extra])).to_bytes(2, "little")


def test_checksum_matches_its_published_check_value():
    assert checksum(b"123456789") == 0x6F91


class Px4:
    """Takes sensors and answers them."""

    def __init__(self, address):
        self.socket = socket.create_connection(address, timeout=120.0)
        self.data, self.seen, self.frames = b"", {}, 0
        self.say(packed(0, 0, 2, 12, 0, 4, 3))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def say(self, data):
        self.socket.sendall(data)

    def message(self):
        """The next message's number and fields; its checksum must be right."""
        while len(self.data) < 12 or len(self.data) < 12 + self.data[1]:
            data = self.socket.recv(4096)
            if not data:
                raise EOFError
            self.data += data
        n = self.data[1]
        frame, self.data = self.data[: 12 + n], self.data[12 + n :]
        assert frame[0] == 0xFD
        number = int.from_bytes(frame[7:10], "little")
        extra, layout = MESSAGES[number]
        assert checksum(frame[1:-2] + bytes([extra])) == int.from_bytes(frame[-2:], "little")
        size = struct.calcsize(layout)  # zeros at the end are left out, extensions come behind it
        return number, struct.unpack(layout, frame[10:-2].ljust(size, b"\0")[:size])

    def sensors(self):
        """Return the next HIL_SENSOR; earlier messages are in `seen`."""
        while True:
            number, fields = self.message()
            self.seen[number] = fields
            if number == 107:
                return fields

    def answer(self, controls, mode=ARMED):
        values = (*controls, *[0.0] * (16 - len(controls)))
        self.say(packed(93, self.frames, 1, *values, mode, sequence=self.frames))
        self.frames += 1


@pytest.fixture
def serve_px4(serve):
    return functools.partial(serve, kind=HilServer, of=("px4", make_control_law), record_rate=1000.0)


def down(u):
    return (0.0,) * 4 + (-u,) * 4


@pytest.mark.slow
def test_vehicle_is_held_until_first_controls_then_steps_once_per_message(serve_px4):
    served = serve_px4("time.duration=0.4")
    with Px4(served.address) as px4:
        held = [px4.sensors() for _ in range(3)]
        for fields in held:
            assert fields[1:4] == pytest.approx((0.0, 0.0, -9.81), abs=1e-6)
        times = [fields[0] for fields in held]
        for _ in range(100):
            px4.answer(down(0.5))
            if px4.frames < 100:
                times.append(px4.sensors()[0])
    outcome = served.outcome()
    assert times == [4000 * (i + 1) for i in range(len(times))]
    (run,) = outcome.runs
    assert (run.summary["status"], run.summary["law"], outcome.counts.steps) == ("completed", "px4", 100)
    record = load_record(run.folder)
    assert record["time"].tolist() == [k * (1.0 / RATE) for k in range(101)]
    assert set(record["thrust[5]"]) == {-20.0}
    assert record["position.z"][-1] > 0.31


def fly(px4, controls, frames):
    """Answer each frame of sensors; return the last."""
    for _ in range(frames):
        fields = px4.sensors()
        px4.answer(controls(fields) if callable(controls) else controls)
    return fields


def test_a_vehicle_is_held_until_it_is_armed_and_has_no_force_once_it_is_disarmed(serve_px4):
    served = serve_px4("time.duration=0.1")
    with Px4(served.address) as px4:
        for k in range(50):
            fields = px4.sensors()
            if k < 25:  # at rest, though heavier than the water
                assert fields[1:4] == pytest.approx((0.0, 0.0, -9.81), abs=1e-6)
            px4.answer(down(1.0), mode=ARMED if k == 25 else 0)
        outcome = served.outcome()
    forces = load_record(outcome.runs[0].folder)["thrust[5]"]
    assert (outcome.counts.waited, outcome.counts.steps) == (25, 25)
    assert forces[0] < 0.0 and not forces[1:].any()


@pytest.mark.slow
def test_depth_is_held_by_barometer_feedback(serve_px4):
    """By the pressure of fresh water, as it comes over the wire."""
    served = serve_px4("time.duration=20.0")
    memory = [0.0, 0.0]

    def depth_of(fields):
        return (fields[10] - 1013.25) / 98.0665

    def controls(fields):
        depth = depth_of(fields)
        sinking = (depth - memory[0]) * RATE
        memory[0] = depth
        memory[1] += 0.02 * (sinking - memory[1])
        return down(min(max(0.5 * (2.0 - depth) - 0.5 * memory[1], -0.3), 0.3))

    with Px4(served.address) as px4:
        last = fly(px4, controls, 20 * RATE)
        (run,) = served.outcome().runs
    record = load_record(run.folder)
    assert depth_of(last) == pytest.approx(record["position.z"][-2], abs=0.01)
    assert abs(record["position.z"][record["time"] > 15.0] - 2.0).max() < 0.05
    number_of_gps = px4.seen[113]
    assert number_of_gps[1] == pytest.approx(55.9097e7, abs=50) and number_of_gps[2] == pytest.approx(-3.3203e7, abs=50)
    assert number_of_gps[3] == pytest.approx(-2000, abs=60)
    assert px4.seen[0][2] == 8  # a heartbeat of no autopilot


def test_reconnecting_autopilot_starts_a_new_run(serve_px4):
    served = serve_px4("time.duration=0.4")
    with Px4(served.address) as px4:
        fly(px4, down(0.3), 20)
        px4.sensors()
    with Px4(served.address):
        pass  # left before it said anything: no run
    with Px4(served.address) as px4:
        assert px4.sensors()[0] == 4000
        px4.answer(down(0.3))
        fly(px4, down(0.3), 99)
        one, two = served.outcome().runs
    assert (one.summary["status"], two.summary["status"]) == (LEFT, "completed")
    assert two.folder.name == f"{one.folder.name}-2"


@pytest.mark.slow
def test_garbage_between_frames_is_ignored(serve_px4):
    found = []
    for rubbish in (b"", b"\x00not mavlink\xff", packed(93, 1, 1, *[1.0] * 16, ARMED)[:-1] + b"\0"):
        served = serve_px4("time.duration=0.1")
        with Px4(served.address) as px4:
            for _ in range(25):
                px4.sensors()
                px4.say(rubbish)
                px4.answer(down(0.5))
            outcome = served.outcome()
        assert (outcome.counts.malformed > 0) == bool(rubbish)
        record = load_record(outcome.runs[0].folder)
        found.append(record.stack(list(record.units)))
    assert np.array_equal(found[0], found[1]) and np.array_equal(found[0], found[2])


@pytest.mark.medium
def test_silence_ends_the_run(serve_px4):
    served = serve_px4(timeout=0.3)
    with Px4(served.address) as px4:
        fly(px4, down(0.1), 5)
        (run,) = served.outcome().runs
    assert run.summary["status"] == "ended: silence for 0.3 s"
    with pytest.raises(RunError, match="no autopilot connected"):
        serve_px4(timeout=0.1).outcome()


def test_pressure_is_that_of_water_below_the_surface_and_of_air_above():
    """Ten meters of fresh water are 0.968 atmospheres; ten meters of air are 1.2 hPa."""
    assert pressure_at(10.0) == pytest.approx(1013.25 * 1.9678, rel=1e-4)
    assert pressure_at(-10.0) == pytest.approx(1013.25 - 1.2, abs=0.01)


def test_the_field_of_a_vehicle_at_rest_never_stays_the_same():
    """PX4's DataValidator takes a hundred equal values for a dead sensor; then it has no heading."""
    zero = (0.0,) * 3
    motion = Motion(0.0, zero, (0.0, 0.0, -9.8), zero, zero, zero, (1.0, 0.0, 0.0, 0.0), 3.0, zero)
    times = [(frame + 1) * 1_000_000 // RATE for frame in range(5)]
    fields = [hil_messages(dialect(), motion, time, (55.0, -3.0), False)[-1].xmag for time in times]
    assert all(a != b for a, b in itertools.pairwise(fields))
    assert fields == pytest.approx([FIELD_NED[0]] * 5, abs=1e-3)


def test_magnetic_field_and_speeds_are_in_their_frames_and_saturated():
    """Facing east the field's north is to the left."""
    zero, east = (0.0,) * 3, (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
    motion = Motion(0.0, zero, (0.0, 0.0, -9.8), zero, (1e4, 0.0, -1e4), zero, east, 3.0, zero)
    gps, truth, sensor = hil_messages(dialect(), motion, 8000, (55.0, -3.0), True)
    assert (sensor.xmag, sensor.ymag, sensor.zmag) == pytest.approx((FIELD_NED[1], -FIELD_NED[0], FIELD_NED[2]))
    assert (gps.vn, gps.vd, gps.vel) == (32767, -32767, 65535)
    assert (truth.vx, truth.zacc) == (32767, -999)
    assert gps.pack(dialect().MAVLink(None))  # it goes into its fields
