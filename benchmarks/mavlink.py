"""Times of MAVLink: a message, a step beside traffic and under a flood, a connection, a frame of an autopilot."""

from __future__ import annotations

import contextlib
import os
import socket
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import sitl
from benchmarks.hostile import hostile_datagrams
from benchmarks.table import Row, with_base
from benchmarks.timing import Timing, time_calls
from cosim.mavlink.channels.udp import UdpIn, UdpOut
from cosim.mavlink.messages.message_table import message_specs
from cosim.mavlink.thread import LinkThread
from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.mavlink.wire.dialect import dialect
from cosim.mavlink.wire.framing import FrameFilter, RxStats
from cosim.mavlink.wire.link import Link, Signer
from cosim.mavlink.wire.options import PROFILES, MavlinkOptions
from cosim.mavlink.wire.signing import SigningClock
from cosim.scenario.scenario import load_scenario
from cosim.simulation.master import Master
from cosim.simulation.signals import Array
from tests.cosim.mavlink.running import GroundStation, running_vehicle

STEPS = 20_000
RATIO = "how many times as long as what it is compared with"
DATAGRAMS_PER_STEP = 10  # datagrams of a flood per step
_SENT = (0, 1, 2, 24, 29, 30, 31, 32, 33, 36, 42, 62, 65, 74, 85, 137, 245)  # ids of the messages of a round
_ROUNDS = 50  # rounds per second of the wall clock
_MESSAGES = _ROUNDS * len(_SENT)  # messages per second
_SOURCE = (1, 1)  # system id and component id of the sender
_PACE = 1000.0  # steps/s, rate of the scenario in real time


class Seventeen:
    """A vehicle that sends seventeen of its messages at 50 Hz of the wall clock, independent of the run's speed."""

    def __init__(self, master: Master) -> None:
        self._context = VehicleContext(master.scenario, master.signals.columns, MavlinkOptions(), None)
        self._row: Array | None = None
        self._rounds = 0
        self._began = time.monotonic()
        self.busy = 0.0

    def attach(self, link: Link) -> None:
        """Start to send on a link."""
        self._context.links.append(link)

    def observe(self, row: Array) -> None:
        """Store the row for the next messages."""
        self._row = row

    def receive(self, link: Link, message: Any, now: float) -> None:
        """Send a message in answer to a received one."""
        self._send(_SENT[0])

    def tick(self, now: float) -> None:
        """Send the messages that are due."""
        while self._row is not None and self._rounds < (now - self._began) * _ROUNDS:
            self._rounds += 1
            self._context.update(self._row)
            for number in _SENT:
                self._send(number)

    def _send(self, number: int) -> None:
        for message in message_specs()[number].build(self._context):
            self._context.send(message)

    def close(self, now: float) -> None:
        """Store the fraction of a processor that the thread has used."""
        self.busy = time.thread_time() / (now - self._began)


def measure(steps: int, repeats: int, datagrams: int | None = None) -> list[Row]:
    """Time messages, steps beside them, and steps under a flood of datagrams, by default ten per step."""
    count = datagrams or DATAGRAMS_PER_STEP * steps
    return [
        *_messages(steps, repeats),
        *_beside_traffic(steps, repeats),
        *_connecting(repeats),
        *_in_lockstep(steps, repeats),
        *_under_flood(count, steps, repeats),
    ]


# ---- a message ----


def _messages(calls: int, repeats: int) -> list[Row]:
    mavlink = dialect()
    attitude = mavlink.MAVLink_attitude_message(1, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
    odometry = mavlink.MAVLink_odometry_message(
        1, 1, 12, 1.5, 2.5, 3.5, [1.0, 0.0, 0.0, 0.1], *[0.5] * 6, [0.25] * 21, [0.75] * 21, 0, 8, 100
    )
    timings: dict[str, Timing | str] = {}
    with _sink() as port:
        plain, signed = _link(port), _link(port, Signer(bytes(32), SigningClock(), 0))
        works: dict[str, Callable[[], object]] = {
            "message: encode and send ATTITUDE": lambda: plain.send(attitude),
            "message: the same, signed": lambda: signed.send(attitude),
            "message: encode and send ODOMETRY": lambda: plain.send(odometry),
        }
        rx = FrameFilter(RxStats(), _SOURCE)
        frames = {"accepted": attitude.pack(mavlink.MAVLink(None, 255, 190)), "random": next(hostile_datagrams(1, 0))}
        for name, frame in frames.items():
            works[f"message: check and decode, {name}"] = lambda frame=frame: list(rx.read_datagram(frame))
        for name, work in works.items():
            timings[name] = time_calls(work, calls, repeats)
        plain.channel.close()
        signed.channel.close()
    return with_base(timings)


# ---- a step beside ordinary traffic ----


def _beside_traffic(steps: int, repeats: int) -> list[Row]:
    """Time parts of one run at full speed, in turn without and with a link, so that load affects both alike."""
    alone, beside, busy = [], [], []
    with _endless() as master, _sink() as port:
        k = 0
        for i in range(2 + 2 * repeats):
            vehicle = Seventeen(master)
            links = LinkThread(vehicle, [_link(port)], master.scenario.time.step) if i % 2 else None
            taken = _stretch(master, range(k, k + steps), links)
            k += steps
            if i > 1:  # the first of each kind compiles, and fills the caches
                (beside if i % 2 else alone).append(taken)
                busy += [vehicle.busy] if i % 2 else []
    first, second = "step: no link", f"step: {_MESSAGES} messages/s"
    lost = statistics.median(b / a - 1.0 for a, b in zip(alone, beside, strict=True))
    return [
        *with_base({first: Timing(tuple(alone)), second: Timing(tuple(beside))}),
        Row(f"{second}, lost", f"{lost:.2%}, the median of {len(alone)} pairs"),
        Row(f"{second}, its thread", f"{statistics.median(busy):.2%} of a processor"),
    ]


def _stretch(master: Master, steps: range, links: LinkThread | None) -> float:
    """Run steps, with links unless None, and return the time per step [s]."""
    if links is not None:
        links.start()
    before = time.perf_counter()
    for k in steps:
        master.step(k)
        if links is not None:
            links.observe(k, master.signals.row)
    taken = time.perf_counter() - before
    if links is not None:
        links.close()
    return taken / len(steps)


def _endless() -> Master:
    return Master(load_scenario("paper", ["arbiter.engine=closed", "time.duration=100000"]))


# ---- a connection, and a frame of an autopilot ----


def _connecting(repeats: int) -> list[Row]:
    """Connect as QGroundControl does, to a run of each profile that steps in real time."""
    rows = []
    for profile in PROFILES:
        seconds, retries, file_retries = [], 0, 0
        for _ in range(repeats):
            with (
                GroundStation() as station,
                running_vehicle([station.endpoint], MavlinkOptions(profile=profile, commands=True)),
            ):
                seconds.append(sum(station.connect().values()))
                retries = max(retries, station.retries)
                file_retries = max(file_retries, station.file_retries)
        name = f"QGroundControl connects, {profile}, with {retries} retries at the most, {file_retries} of files"
        rows.append(Row(name, Timing(tuple(seconds))))
    return rows


def _in_lockstep(steps: int, repeats: int) -> list[Row]:
    timing = sitl.lockstep(steps, repeats)
    return [Row(f"frame of an autopilot: {1 / timing.median:.0f}/s", timing)]


# ---- a step under a flood ----


def _under_flood(datagrams: int, steps: int, repeats: int) -> list[Row]:
    """Time each step, from its due time to its end, of runs in real time and of runs at full speed."""
    rows: list[Row] = []
    grown, looked, errors = 0.0, [], 0
    for pace, name in ((_PACE, f"step at {_PACE:.0f}/s"), (None, "step at full speed")):
        times_by_case: dict[str, list[Array]] = {"calm": [], "flood elsewhere": [], "flood": []}
        for repeat in range(repeats):
            for case, all_times in times_by_case.items():
                before = _resident()
                flood = 0 if case == "calm" else datagrams
                times, link, failures = _flooded(flood, steps, pace, repeat, at_us=case == "flood")
                all_times.append(times)
                errors += failures
                if case == "flood":
                    grown = max(grown, _resident() - before if repeat else 0.0)  # the first repeat fills the caches
                    looked.append(_total_count(link.stats) / datagrams)
        timings: dict[str, Timing | str] = {}
        for case, all_times in times_by_case.items():
            for quantile, word in ((0.5, "median"), (0.999, "99.9th percentile")):
                of_each = tuple(float(np.quantile(times, quantile)) for times in all_times)
                timings[f"{name}, {case}: {word}"] = Timing(of_each)
        rows += with_base(timings)
    summary = f"{datagrams} datagrams each, {statistics.median(looked):.1%} looked at, {errors} errors, "
    rows.append(Row("floods", f"{summary}{grown / 1e6:+.1f} MB of memory"))
    return rows


def _flooded(datagrams: int, steps: int, pace: float | None, seed: int, *, at_us: bool) -> tuple[Array, Link, int]:
    """Run steps beside a link while a flood lasts, or without a flood for a number of steps.

    With `at_us` False the flood goes to a port without a reader: it costs the machine the same time, the link none.

    Returns
    -------
    (array, Link, int)
        Time of each step from its due time to its end [s], the link, and the number of errors in its thread.
    """
    channel = UdpIn("127.0.0.1", 0)
    link = Link("flooded", channel, FrameFilter(RxStats(), _SOURCE), _SOURCE)
    times = []
    with (
        _endless() as master,
        _sink() as sink,
        _attacker(channel.port if at_us else sink, datagrams, seed) as is_running,
    ):
        links = LinkThread(Seventeen(master), [link], master.scenario.time.step)
        links.start()
        due = time.perf_counter()
        for k in range(master.scenario.steps):
            if pace is None:
                due = time.perf_counter()
            else:
                due = max(due + 1.0 / pace, time.perf_counter())
                time.sleep(max(0.0, due - time.perf_counter()))
            master.step(k)
            links.observe(k, master.signals.row)
            times.append(time.perf_counter() - due)
            if not is_running(k, steps):
                break
        links.close()
    return np.array(times[1:]), link, sum(links.failures.values())


@contextlib.contextmanager
def _attacker(port: int, datagrams: int, seed: int) -> Iterator[Callable[[int, int], bool]]:
    """Yield a function of step and count that returns True while another process floods a port.

    Without datagrams it returns True for `count` steps.
    """
    if not datagrams:
        yield lambda k, steps: k < steps
        return
    command = [sys.executable, "-m", "benchmarks.hostile", str(port), str(datagrams), str(seed)]
    with subprocess.Popen(command, cwd=Path(__file__).parents[1], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()  # the process has prepared its datagrams, and begins
        yield lambda k, steps: (k + 1) % 16 > 0 or process.poll() is None  # poll every 16 steps


def _total_count(counts: RxStats) -> int:
    return sum(getattr(counts, name) for name in counts.__slots__)


def _resident() -> float:
    """Return the resident memory of this process [bytes]; 0 if the system does not report it."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:
        return 0.0
    return float(pages * os.sysconf("SC_PAGE_SIZE"))


def _link(port: int, signer: Signer | None = None) -> Link:
    return Link("benchmark", UdpOut("127.0.0.1", port), FrameFilter(RxStats(), _SOURCE), _SOURCE, signer=signer)


@contextlib.contextmanager
def _sink() -> Iterator[int]:
    """Yield a port whose datagrams have no reader."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sink:
        sink.bind(("127.0.0.1", 0))
        yield sink.getsockname()[1]
