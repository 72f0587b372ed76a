"""Behavior that both servers share: runs begin anew, silence ends them, and garbage is ignored."""

import random
import struct
from contextlib import closing

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink

from cosim.errors import RunError
from cosim.results.record import load_record
from cosim.sitl.hil_server import LEFT, HilServer
from cosim.sitl.json_server import JsonServer
from cosim.sitl.law import make_pwm_law
from cosim.sitl.sitl_session import RESTARTED, FlightOptions, SitlSession
from tests.cosim.sitl.stand_in import Px4, StandIn, controls_message, down, heave


@pytest.fixture(params=["json", "hil"])
def kind(request):
    return request.param


@pytest.fixture
def begin(kind, request):
    """Return a function that serves the autopilot of the kind."""
    return request.getfixturevalue({"json": "serve", "hil": "serve_px4"}[kind])


CODEC = mavlink.MAVLink(None, 1, 1)


def garbage(draw, k):
    """Return datagrams and parts of a stream that are no frames: lengths, rates and checksums are wrong."""
    sizes = [0, 1, 39, 40, 41, 72, 1400]
    datagrams = draw.randbytes(draw.choice(sizes)), struct.pack("<HHI16H", 18458, draw.randrange(11), k, *[1900] * 16)
    stream = b"\x00not mavlink\xff", bytes(controls_message([1.0] * 16).pack(CODEC)[:-1]) + b"\0"
    return {"json": datagrams, "hil": stream}


def fly(kind, served, frames, spoils=False):
    """Exchange frames with an autopilot of its own, perhaps among garbage; return the answers."""
    draw, answers = random.Random(1), []
    with {"json": StandIn, "hil": Px4}[kind](served.address) as pilot:
        for k in range(frames):
            for data in garbage(draw, k)[kind] if spoils else ():
                (pilot.send if kind == "json" else pilot.say)(data)
            answers.append(pilot.exchange(heave(0.8)) if kind == "json" else pilot.fly(down(0.5)))
    return answers


def test_garbage_is_counted_and_ignored(kind, begin):
    records, frames = [], {"json": 120, "hil": 25}[kind]
    for spoils in (False, True):
        served = begin("time.duration=0.1")
        fly(kind, served, frames, spoils)
        outcome = served.outcome()
        assert outcome.counts.steps == frames and (outcome.counts.malformed > 0) == spoils
        assert kind == "hil" or outcome.counts.malformed == 2 * frames * spoils
        record = load_record(outcome.runs[0].folder)
        records.append(record.stack(list(record.units)))
    assert np.array_equal(*records)


def test_a_new_connection_or_count_starts_a_new_run_from_the_initial_state(kind, begin):
    served = begin("time.duration=0.1")
    if kind == "json":
        with StandIn(served.address) as pilot:
            before = [pilot.exchange(heave(0.8)) for _ in range(50)]
            pilot.count = 0
            after = [pilot.exchange(heave(0.8)) for _ in range(120)]
    else:
        before = fly(kind, served, 20)
        with Px4(served.address):
            pass  # left before it said anything: no run
        after = fly(kind, served, 25)
    same = {"json": 50, "hil": 1}[kind]  # PX4's sensors go on while it has not answered
    assert after[:same] == before[:same]
    one, two = served.outcome().runs
    assert (one.summary["status"], two.summary["status"]) == ({"json": RESTARTED, "hil": LEFT}[kind], "completed")
    assert two.folder.name == f"{one.folder.name}-2"
    lengths = [len(load_record(run.folder)["time"]) for run in (one, two)]
    assert kind == "hil" or lengths == [50, 121]


@pytest.mark.medium
def test_silence_ends_the_run_after_the_timeout(kind, begin):
    served = begin(timeout=0.3)
    if kind == "json":
        fly(kind, served, 5)
        outcome = served.outcome()
    else:
        with Px4(served.address) as px4:
            px4.fly(down(0.1), 5)
            outcome = served.outcome()
    (run,) = outcome.runs
    assert (run.summary["status"], run.summary["steps"]) == ("ended: silence for 0.3 s", 4)


def test_without_an_autopilot_there_is_no_run(begin):
    with pytest.raises(RunError, match=r"no autopilot connected: ended: silence for 0.2 s"):
        begin(timeout=0.2).outcome()


def test_occupied_port_is_reported(kind):
    server, name = {"json": (JsonServer, "UDP"), "hil": (HilServer, "TCP")}[kind]
    session = SitlSession(FlightOptions(), "ardupilot", make_pwm_law)
    with closing(server(session, ("127.0.0.1", 0))) as first:
        with pytest.raises(RunError, match=rf"{name} 127.0.0.1:{first.address[1]}: Address already in use"):
            server(session, first.address)
