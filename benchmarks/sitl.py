"""Time of a frame of an autopilot in lockstep, over loopback, against a stand-in in a process of its own."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from benchmarks import sitl_pilot
from benchmarks.sitl_pilot import HEAD, MAGIC, PULSES, RATE, WARMING
from benchmarks.table import Row, with_base
from benchmarks.timing import Timing, time_calls
from cosim.sitl import json_protocol
from cosim.sitl.json_server import JsonServer
from cosim.sitl.law import make_pwm_law
from cosim.sitl.sitl_session import FlightOptions, SitlSession

STEPS = 12_000
RATIO = "how many times as long as the plant's step"


def measure(steps: int, repeats: int) -> list[Row]:
    """Time the parts of a frame, and whole frames by the stand-in's clock."""
    timings: dict[str, Timing | str] = {}
    with tempfile.TemporaryDirectory() as folder:
        flights = SitlSession(FlightOptions(out=Path(folder) / "run", report=False), "ardupilot", make_pwm_law)
        flight = flights.begin(RATE)
        packet = HEAD.pack(MAGIC, RATE, 7) + PULSES
        motion = flight.step()
        decoded = json_protocol.parse_packet(packet)
        assert decoded is not None
        outputs = decoded.pwm

        def add_calls(name: str, work: Callable[[], object]) -> None:
            timings[name] = time_calls(work, steps, repeats)

        add_calls("FMU: one step", lambda: flight._master.plant.step(1.0 / RATE))
        add_calls("packet read", lambda: json_protocol.parse_packet(packet))
        add_calls("pulses to forces", lambda: flights.law.set_outputs(outputs))
        add_calls("master's step, record at 100 Hz, motion", flight.step)
        add_calls("answer written", lambda: json_protocol.format_motion(motion))
        flights.end("ended: measured")
    for what, record_rate in (("record at 100 Hz", 100.0), ("every step recorded", float(RATE))):
        timing = lockstep(steps, repeats, record_rate)
        timings[f"whole frame, {what}: {1 / timing.median:.0f} frames/s"] = timing
    return with_base(timings)


def lockstep(steps: int, repeats: int, record_rate: float = 100.0) -> Timing:
    """Time frames of whole flights: the server is in this process, the stand-in, which measures, in another one."""
    times = []
    overrides = (f"time.step={1.0 / RATE!r}", f"time.duration={(WARMING + steps) / RATE!r}")
    for _ in range(repeats):
        with tempfile.TemporaryDirectory() as folder:
            options = FlightOptions(
                overrides=overrides, out=Path(folder) / "run", record_rate=record_rate, report=False
            )  # fmt: skip
            server = JsonServer(SitlSession(options, "ardupilot", make_pwm_law), ("127.0.0.1", 0), timeout=10.0)
            command = [sys.executable, sitl_pilot.__file__, str(server.address[1]), str(steps)]
            with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as pilot:
                server.serve()
                printed, _ = pilot.communicate(timeout=60.0)
            times.append(float(printed) / steps)
    return Timing(tuple(times))
