"""Lockstep with a stand-in for ArduPilot: exact, repeated, lost and foreign frames; restarts; and records."""

import random
import select
import time
from importlib import resources

import numpy as np
import pytest

from cosim.results.record import load_record
from cosim.simulation.master import Master
from cosim.sitl import json_server, motion
from cosim.sitl.law import make_pwm_law
from cosim.sitl.sitl_session import RESTARTED, FlightOptions, SitlSession, scenario_to_fly
from plant_fmu import load_vehicle
from tests.cosim.sitl.stand_in import DISARMED, NEUTRAL, StandIn, frame, heave, newest_line, parse

DT, HALF = 1.0 / 1200, 0.5**0.5


def rows(run):
    record = load_record(run.folder)
    return record.stack(list(record.units))


def fly(served, frames, pwm=NEUTRAL, **pilot):
    """Exchange so many frames, with constant pulses or a function of the frame's number.

    Return the answers, the outcome, and the record of its one run.
    """
    with StandIn(served.address, **pilot) as pilot:
        answers = [pilot.fly(pwm(k) if callable(pwm) else pwm) for k in range(frames)]
    outcome = served.outcome()
    (run,) = outcome.runs
    return answers, outcome, load_record(run.folder)


def pulses(k):
    """Something else in each frame."""
    return tuple(1500 + round(300 * np.sin(0.01 * k + i)) for i in range(8))


def test_each_frame_is_a_step_of_the_plant(serve, caplog):
    answers, outcome, record = fly(serve("time.duration=0.25"), 300, heave(0.5))
    assert [s["timestamp"] for s in answers] == [(k + 1) * DT for k in range(300)]
    assert (outcome.counts.steps, outcome.counts.lost, outcome.counts.resent) == (300, 0, 0)
    summary = outcome.runs[0].summary
    assert (summary["status"], summary["law"], summary["steps"]) == ("completed", "ardupilot", 300)
    assert record["time"].tolist() == [k * DT for k in range(301)]
    assert record.stack([f"position.{a}" for a in "xyz"])[1:].tolist() == [list(s["position"]) for s in answers]
    assert record["position.z"][-1] > 0.3
    assert set(record["law.pwm5"]) == {1700.0} and not record["law.lost"].any()
    assert set(record["thrust[5]"]) == {-10.0}
    assert not [r for r in caplog.records if r.name.startswith("cosim.sitl")]


STARTS = {  # overrides, and the values of the first answer with their tolerances
    # weight and buoyancy are off by the same amount: the IMU measures gravity alone
    "at rest": (("plant.parameters.weight=131.588", "initial.position=[1,2,3]"), {
        "gyro": ((0.0, 0.0, 0.0), 0.0), "accel_body": ((0.0, 0.0, -9.81), 1e-12), "position": ((1.0, 2.0, 3.0), 1e-6),
        "quaternion": ((1.0, 0.0, 0.0, 0.0), 0.0), "rng_1": (27.0, 1e-5)}),
    # heading east without roll: forward is east, right is south
    "a velocity in NED": ((f"initial.quaternion=[{HALF},0,0,{HALF}]", "initial.velocity=[1.0,0.5,0.25,0,0,0]"), {
        "velocity": ((-0.5, 1.0, 0.25), 0.02), "attitude": ((0.0, 0.0, np.pi / 2), 1e-3)}),
}  # fmt: skip


@pytest.mark.parametrize(("overrides", "expected"), STARTS.values(), ids=STARTS)
def test_first_answer_is_the_motion_at_the_start(serve, overrides, expected):
    (first, *_), *_ = fly(serve("time.duration=0.01", *overrides), 12)
    for key, (value, tolerance) in expected.items():
        assert first[key] == pytest.approx(value, rel=0.0, abs=tolerance), key


def test_vehicle_is_held_until_a_thruster_is_driven(serve):
    """Rolled over and 1 N light it would move; time and the record's time begin apart."""
    served = serve("time.duration=0.1", f"initial.quaternion=[{HALF},{HALF},0,0]", "initial.position=[1,2,0]")
    answers, outcome, record = fly(served, 320, lambda k: (DISARMED, (0,) * 8)[k % 2] if k < 200 else NEUTRAL)
    assert [s["timestamp"] for s in answers] == pytest.approx([(k + 1) * DT for k in range(320)], abs=1e-12)
    assert all(s["position"] == (1.0, 2.0, 0.0) and not any(s["velocity"] + s["gyro"]) for s in answers[:200])
    assert answers[0]["accel_body"] == pytest.approx((0.0, -9.81, 0.0), abs=1e-9) and any(answers[-1]["velocity"])
    assert (outcome.counts.waited, outcome.counts.steps) == (200, 120)
    assert record["time"][-1] == pytest.approx(0.1)


def test_an_idle_autopilot_is_lowered_from_the_surface_and_starts_where_the_scenario_does(serve, monkeypatch):
    """Here within 0.06 s; what drives a thruster before the vehicle is there waits for it."""
    monkeypatch.setattr(motion, "_SURFACE_TIME", 0.02)
    monkeypatch.setattr(motion, "_MAX_DURATION", 0.04)
    served = serve("time.duration=0.02", "initial.position=[1,2,3]")
    answers, outcome, _ = fly(served, 96, lambda k: DISARMED if k < 36 else NEUTRAL)
    depth = np.array([s["position"][2] for s in answers])
    assert not depth[:24].any() and depth[71] == pytest.approx(3.0) and depth[-1] == pytest.approx(3.0, abs=1e-3)
    assert all(np.diff(depth[:72]) >= 0.0)
    assert all(s["position"][:2] == (1.0, 2.0) for s in answers[:72])
    assert (outcome.counts.waited, outcome.counts.steps) == (72, 24)


def test_lowering_motion_is_consistent_with_its_depths():
    """Speed and acceleration against differences of the depth; rolled on its side, the IMU has them along y."""
    lowering, h = motion.Lowering(4.0), 1e-4
    for at in np.linspace(4.2, 9.8, 9):
        before, now, after = (lowering.at(at + by)[0] for by in (-h, 0.0, h))
        assert lowering.at(at)[1:] == pytest.approx(
            [(after - before) / (2 * h), (after - 2 * now + before) / h**2], abs=1e-5
        )
    zero = (0.0, 0.0, 0.0)
    on_its_side = motion.Motion(0.0, zero, zero, (1.0, 2.0, 4.0), zero, zero, (HALF, HALF, 0.0, 0.0), 6.0, zero)
    carried = motion.with_vertical_motion(on_its_side, 3.0, 0.5, 0.2)
    assert carried.specific_force == pytest.approx((0.0, 0.2 - 9.81, 0.0)) and carried.dvl == pytest.approx(
        (0.0, 0.5, 0.0)
    )
    assert (carried.position_ned, carried.velocity_ned, carried.altitude) == ((1.0, 2.0, 3.0), (0.0, 0.0, 0.5), 7.0)


def test_run_equals_a_master_with_the_autopilot_as_law(serve):
    """No step but the master's own: current, failing thruster and arbiter included."""
    overrides = (
        "time.duration=0.5", "plant.current=[0.2,-0.1,0.0]", "failures=[{thruster=5,time=0.2}]",
        "initial.position=[0,0,0.1]",
    )  # fmt: skip
    _, outcome, record = fly(serve(*overrides), 600, pulses)
    law, expected = make_pwm_law(load_vehicle("bluerov2_heavy")), []
    with Master(scenario_to_fly("sitl", overrides, None, 1200, "ardupilot"), law) as master:
        for k in range(601):
            law.set_outputs(pulses(min(k, 599)))
            master.step(k)
            expected.append(master.signals.row.copy())
    assert np.array_equal(rows(outcome.runs[0]), np.array(expected))
    assert record["thruster_force[5]"][239] != 0.0 and not record["thruster_force[5]"][240:].any()
    assert record["weight.depth"].any()


def test_a_resent_frame_gets_the_same_answer_and_makes_no_step(serve, monkeypatch):
    """One that comes at once was on its way as the answer was sent: a second answer would be taken for the next one."""
    monkeypatch.setattr(json_server, "_RESEND_PERIOD", 0.0)
    served = serve("time.duration=0.1")
    with StandIn(served.address) as pilot:
        first = pilot.exchange(NEUTRAL)
        for pwm in (NEUTRAL, heave(1.0), heave(-1.0)):  # whatever its pulses are now
            assert pilot.exchange(pwm, count=0) == first
        monkeypatch.setattr(json_server, "_RESEND_PERIOD", 60.0)
        pilot.send(frame(0, NEUTRAL, pilot.rate, pilot.channels))
        for _ in range(119):
            last = pilot.exchange(NEUTRAL)
    outcome = served.outcome()
    assert parse(newest_line(last))["timestamp"] == 120 * DT
    assert (outcome.counts.steps, outcome.counts.resent) == (120, 4)


def test_what_is_called_before_the_answer_finds_the_autopilot_waiting(serve):
    """So what it sends comes at the same frame, however loaded the machine is."""
    served, waiting = serve("time.duration=0.1"), []
    with StandIn(served.address) as pilot:
        served.server.before_answer = lambda: waiting.append(not select.select([pilot.socket], [], [], 0.0)[0])
        for _ in range(120):
            pilot.exchange(NEUTRAL)
    served.outcome()
    assert waiting == [True] * 120


def test_lost_frames_are_counted_and_advance_one_step(serve, caplog):
    served = serve("time.duration=0.1")
    with StandIn(served.address) as pilot:
        pilot.fly(NEUTRAL)
        pilot.count = 5
        assert pilot.fly(NEUTRAL)["timestamp"] == 2 * DT
        pilot.count = 8
        for _ in range(118):
            pilot.fly(NEUTRAL)
    outcome = served.outcome()
    assert (outcome.counts.steps, outcome.counts.lost) == (120, 6)
    record = load_record(outcome.runs[0].folder)
    assert record["law.lost"].tolist() == [0.0, 4.0, *[6.0] * 119]
    assert [r.message for r in caplog.records] == ["4 frames of the autopilot lost: one step is made for all"]


@pytest.mark.medium
def test_thirty_two_channels_are_accepted(serve, tmp_path):
    path = tmp_path / "mine.toml"
    text = (resources.files("plant_fmu") / "vehicles" / "bluerov2_heavy.toml").read_text()
    path.write_text(text.replace("signs = -1", "signs = -1\nchannels = [25, 26, 27, 28, 29, 30, 31, 32]"))
    served = serve("time.duration=0.1", vehicle=str(path))
    (*_, answer), _, record = fly(served, 120, (*[1900] * 24, *heave(0.5)), channels=32)
    assert answer["velocity"][2] > 0.05 and abs(answer["velocity"][0]) < 1e-3
    assert set(record["law.pwm32"]) == {1700.0}


@pytest.mark.medium
def test_record_does_not_depend_on_wall_clock_timing(serve):
    draw = random.Random(3)

    def late_pulses(k):
        time.sleep(draw.random() * 0.005 if draw.random() < 0.05 else 0.0)
        return pulses(k)

    noise = "plant.parameters.imu.rate=100", "plant.parameters.imu.acceleration_noise=0.1"
    flights = [fly(serve("time.duration=0.3", *noise), 360, pwm) for pwm in (pulses, late_pulses)]
    assert np.array_equal(*(rows(outcome.runs[0]) for _, outcome, _ in flights))


def test_second_sender_is_rejected_while_the_first_is_active(serve):
    served = serve("time.duration=0.1")
    with StandIn(served.address) as pilot, StandIn(served.address) as other:
        for k in range(120):
            pilot.fly(NEUTRAL)
            other.send(frame(k, heave(1.0)))
        outcome = served.outcome()
        other.socket.setblocking(False)
        with pytest.raises(BlockingIOError):
            other.socket.recv(100)
    assert outcome.counts.steps == 120
    assert outcome.counts.rejected >= 119  # the last may have come too late
    assert set(load_record(outcome.runs[0].folder)["law.pwm5"]) == {1501.0}


@pytest.mark.medium
def test_autopilot_on_another_port_replaces_a_silent_one(serve, monkeypatch):
    """With the next count the run continues, as behind a relay; any other count starts a new run."""
    monkeypatch.setattr("cosim.sitl.json_server._SENDER_TIMEOUT", 0.05)
    served = serve("time.duration=0.1")
    for first, steps in ((0, 10), (10, 10), (25, 120)):
        time.sleep(0.1)
        with StandIn(served.address) as pilot:
            pilot.count = first
            answers = [pilot.fly(NEUTRAL)["timestamp"] for _ in range(steps)]
            assert answers[0] == (DT if first != 10 else 11 * DT)
    one, two = served.outcome().runs
    assert (one.summary["status"], one.summary["steps"], two.summary["status"]) == (RESTARTED, 19, "completed")


def test_rate_change_during_a_run_keeps_the_step(serve):
    served = serve("time.duration=0.1")
    with StandIn(served.address) as pilot:
        for k in range(120):
            pilot.rate = 1200 - k
            assert pilot.fly(NEUTRAL)["timestamp"] == (k + 1) * DT
    served.outcome()


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("rate", [11, 50, 400, 4000])
def test_the_step_is_that_of_the_first_frame(serve, rate):
    n = round(0.5 * rate)
    answers, outcome, _ = fly(serve("time.duration=0.5"), n, rate=rate)
    assert [answer["timestamp"] for answer in answers] == [(k + 1) * (1.0 / rate) for k in range(n)]
    assert outcome.runs[0].summary["status"] == "completed"


@pytest.mark.medium
def test_record_is_decimated_and_summary_uses_all_steps(serve):
    flights = [fly(serve("time.duration=0.5", record_rate=rate), 600, heave(0.5)) for rate in (100.0, 1200.0)]
    thin, full = (outcome.runs[0] for _, outcome, _ in flights)
    assert len(load_record(thin.folder)["time"]) == 51
    assert np.array_equal(rows(thin), rows(full)[::12])
    assert thin.summary["steps"] == full.summary["steps"] == 600
    assert thin.summary["effort"] == pytest.approx(full.summary["effort"], rel=1e-9)
    assert full.summary["effort"] == pytest.approx(40.0 * 0.5, rel=1e-6)  # N s


def test_a_plant_that_fails_leaves_its_record(serve):
    served = serve()
    with StandIn(served.address) as pilot:
        for _ in range(5):
            pilot.fly(NEUTRAL)
        served.server.flights.flight._master.plant.close()
        pilot.send(frame(5, NEUTRAL))
        with pytest.raises(Exception, match="clos"):
            served.outcome()
    assert len(load_record(served.server.flights._ended[0][0].folder)["time"]) == 5


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"vehicle": "odin"}, "has no table"), ({"vehicle": "ordin"}, "is unknown"),
        ({"overrides": ("commands.enabled=true",)}, "commands.enabled is true, expected false: the autopilot steers"),
        ({"overrides": ("time.duratoin=3",)}, "duratoin"),
        ({"overrides": ("record.lyapunov=true",)}, "record.lyapunov"),
        ({"out": resources.files("plant_fmu")}, "exists and is not empty"),
    ],
)  # fmt: skip
def test_invalid_scenario_or_folder_is_rejected_before_waiting(changes, words):
    with pytest.raises(Exception, match=words):
        SitlSession(FlightOptions(**changes), "ardupilot", make_pwm_law)
