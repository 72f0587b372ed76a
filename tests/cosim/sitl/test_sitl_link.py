"""The MAVLink connection beside the lockstep: the recorded estimate, and the DVL messages."""

import contextlib

import numpy as np
import pytest

from cosim.mavlink.wire.dialect import dialect
from cosim.mavlink.wire.endpoint import parse_endpoint
from cosim.mavlink.wire.ground_end import GroundLink
from cosim.results.record import load_record
from cosim.sitl.json_server import JsonServer
from cosim.sitl.law import make_pwm_law
from cosim.sitl.motion import Motion
from cosim.sitl.sitl_link import Dvl, DvlOptions, SitlLink
from cosim.sitl.sitl_session import FlightOptions, SitlSession
from tests.cosim.mavlink.stubs import free_port
from tests.cosim.sitl.conftest import Served
from tests.cosim.sitl.stand_in import DISARMED, StandIn, frame

STILL = (0.0, 0.0, 0.0)
STEPS = 48


def motion(time, velocity, gyro=STILL):
    return Motion(time, gyro, STILL, STILL, velocity, STILL, (1.0, 0.0, 0.0, 0.0), None, velocity)


def dvl_messages(options, seconds=10.0, rate=400):
    """Return the DVL messages of a vehicle with a surge of 0.5 m/s and a yaw rate of 0.1 rad/s."""
    dvl = Dvl(options)
    messages = []
    for k in range(round(seconds * rate) + 1):
        time = k / rate
        messages += [(time, *message) for message in dvl.integrate(motion(time, (0.5, 0.0, 0.0), (0.0, 0.0, 0.1)))]
    return messages


def test_dvl_displacements_sum_to_the_motion():
    messages = dvl_messages(DvlOptions(rate=8.0, latency=0.0))
    assert len(messages) == 80
    assert {interval for _, _, interval, _, _ in messages} == {125_000}
    assert np.sum([moved for *_, moved in messages], axis=0) == pytest.approx((5.0, 0.0, 0.0))
    assert np.sum([turned for *_, turned, _ in messages], axis=0) == pytest.approx((0.0, 0.0, 1.0))


@pytest.mark.medium
def test_dvl_has_its_configured_latency_and_dropout():
    late = dvl_messages(DvlOptions(rate=8.0, latency=0.25))
    assert [time - stamp / 1e6 for time, stamp, *_ in late] == pytest.approx([0.25] * len(late), abs=1e-6)
    lossy = dvl_messages(DvlOptions(rate=8.0, latency=0.0, dropout=0.3), seconds=100.0)
    assert 480 <= len(lossy) <= 640  # of 800
    assert [m[1] for m in lossy] == [m[1] for m in dvl_messages(DvlOptions(8.0, 0.0, 0.3), seconds=100.0)]


def test_estimate_is_recorded_and_arming_releases_the_vehicle(tmp_path):
    m, port = dialect(), free_port()
    link = SitlLink(parse_endpoint(f"udpin:127.0.0.1:{port}"), DvlOptions(rate=100.0, latency=0.0))
    options = FlightOptions(
        "sitl", (f"time.duration={STEPS / 1200}", "initial.position=[0,0,0]"), "bluerov2_heavy", tmp_path / "run",
        2000.0, report=False,
    )  # fmt: skip
    flights = SitlSession(options, "ardupilot", lambda vehicle: make_pwm_law(vehicle, link))
    served = Served(JsonServer(flights, ("127.0.0.1", 0), 60.0))
    served.start()
    messages = []
    with (
        StandIn(served.address) as pilot,
        GroundLink(parse_endpoint(f"udpout:127.0.0.1:{port}"), identity=(1, 1)) as autopilot,
    ):

        def say(armed):
            autopilot.send(m.MAVLink_heartbeat_message(m.MAV_TYPE_SUBMARINE, 3, 1 | armed, 19, 4, 3))
            autopilot.send(m.MAVLink_local_position_ned_message(1, 4.0, 5.0, 6.0, 0.1, 0.2, 0.3))

        say(armed=0)
        for _ in range(60):  # 50 ms, of which it listens to each sixth
            pilot.fly(DISARMED)
        while served.is_alive():
            say(armed=128)
            messages += [received.message for received in autopilot.receive(0.0)]
            pilot.send(frame(pilot.count, DISARMED))
            with contextlib.suppress(TimeoutError):
                pilot.socket.settimeout(0.05)
                pilot.socket.recv(65000)
                pilot.count += 1
    outcome = served.outcome()
    link.close()
    assert outcome.counts.steps == STEPS and outcome.counts.waited >= 60
    deltas = [m for m in messages if m.get_type() == "VISION_POSITION_DELTA"]
    assert deltas and np.abs([m.position_delta for m in deltas]).max() < 1e-3
    assert {m.time_delta_usec for m in deltas} == {10_000}  # the DVL's rate
    asked = {m.param1 for m in messages if m.get_type() == "COMMAND_LONG"}
    assert asked == {0.0, 31.0, 32.0}
    record = load_record(outcome.runs[0].folder)
    assert [record[f"law.estimate.{name}"][-1] for name in ("x", "y", "z", "vz")] == pytest.approx([4, 5, 6, 0.3])
    assert (record["law.mode"][-1], record["law.armed"][-1]) == (19.0, 1.0)
