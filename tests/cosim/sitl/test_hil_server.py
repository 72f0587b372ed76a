"""PX4's simulator interface, against a stand-in that packs and reads MAVLink 2 by hand."""

import itertools
import math

import pytest

from cosim.mavlink.wire.dialect import dialect
from cosim.results.record import load_record
from cosim.sitl.hil_messages import FIELD_NED, RATE, hil_messages, pressure_at
from cosim.sitl.motion import Motion
from tests.cosim.sitl.stand_in import ARMED, Px4, down


@pytest.mark.slow
def test_vehicle_is_held_until_first_controls_then_steps_once_per_message(serve_px4):
    served = serve_px4("time.duration=0.4")
    with Px4(served.address) as px4:
        held = [px4.sensors() for _ in range(3)]
        for sensors in held:
            assert (sensors.xacc, sensors.yacc, sensors.zacc) == pytest.approx((0.0, 0.0, -9.81), abs=1e-6)
        times = [sensors.time_usec for sensors in held]
        for _ in range(100):
            px4.answer(down(0.5))
            if px4.frames < 100:
                times.append(px4.sensors().time_usec)
    outcome = served.outcome()
    assert times == [4000 * (i + 1) for i in range(len(times))]
    (run,) = outcome.runs
    assert (run.summary["status"], run.summary["law"], outcome.counts.steps) == ("completed", "px4", 100)
    record = load_record(run.folder)
    assert record["time"].tolist() == [k * (1.0 / RATE) for k in range(101)]
    assert set(record["thrust[5]"]) == {-20.0}
    assert record["position.z"][-1] > 0.31


def test_a_vehicle_is_held_until_it_is_armed_and_has_no_force_once_it_is_disarmed(serve_px4):
    served = serve_px4("time.duration=0.1")
    with Px4(served.address) as px4:
        for k in range(50):
            sensors = px4.sensors()
            if k < 25:  # at rest, though heavier than the water
                assert (sensors.xacc, sensors.yacc, sensors.zacc) == pytest.approx((0.0, 0.0, -9.81), abs=1e-6)
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

    def depth_of(sensors):
        return (sensors.abs_pressure - 1013.25) / 98.0665

    def controls(sensors):
        depth = depth_of(sensors)
        sinking = (depth - memory[0]) * RATE
        memory[0] = depth
        memory[1] += 0.02 * (sinking - memory[1])
        return down(min(max(0.5 * (2.0 - depth) - 0.5 * memory[1], -0.3), 0.3))

    with Px4(served.address) as px4:
        last = px4.fly(controls, 20 * RATE)
        (run,) = served.outcome().runs
    record = load_record(run.folder)
    assert depth_of(last) == pytest.approx(record["position.z"][-2], abs=0.01)
    assert abs(record["position.z"][record["time"] > 15.0] - 2.0).max() < 0.05
    gps = px4.seen["HIL_GPS"]
    assert (gps.lat, gps.lon) == pytest.approx((55.9097e7, -3.3203e7), abs=50) and gps.alt == pytest.approx(
        -2000, abs=60
    )
    assert px4.seen["HEARTBEAT"].autopilot == 8  # of no autopilot


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
