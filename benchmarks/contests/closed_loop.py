"""The closed loop of the paper's scenario at 100 Hz, paper's law, closed form: a step of it, and whole runs."""

from __future__ import annotations

import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from benchmarks.contest import Contest, Entry
from benchmarks.peer_environment import Environment
from benchmarks.peer_process import peer
from benchmarks.timing import Contestant, NotMeasuredError
from cosim.batch.fused import FusedFlyer
from cosim.batch.variation import Variation
from cosim.results.recorder import Recorder
from cosim.scenario.scenario import load_scenario
from cosim.simulation.master import Master

SCENARIO = "paper"
STEP = 0.01  # s, common step of law, arbiter and plant
CHANGES = (
    "arbiter.engine=closed", "law.name=ismail_dunnigan", f"plant.substep={STEP}",
    *(f"time.{key}={STEP}" for key in ("step", "control", "arbiter")),
)  # fmt: skip
RUN = 30.0  # s, duration of a run
BATCH = 64  # default number of concurrent runs
# name in the table: distribution, and module of `benchmarks.peers`
_MASTERS = {
    "FMPy, simulate_ssp": ("fmpy", "fmpy_system"),
    "Ecos": ("ecospy", "ecos_system"),
    "libcosim": ("libcosimpy", "libcosim_system"),
}


def contests(environment: Environment) -> Iterator[Contest]:
    """Yield the contests of the closed loop."""
    with tempfile.TemporaryDirectory(prefix="benchmark-") as folder:
        package = _Package(Path(folder) / "paper.ssp")
        peers = {name: _system(environment, package, *where, "steps") for name, where in _MASTERS.items()}
        yield Contest(
            "A step of the closed loop: plant, regions, arbiter, law",
            {
                "master, no record": _master(record=False),
                "master, every step recorded": _master(record=True),
                "fused loop": flights(per_run=False),
            },
            peers,
        )
        yield Contest(
            f"A run of {RUN:g} s of it, from loading or resetting to the outcome",
            {"fused loop": flights()},
            {f"{name}, loaded anew": _system(environment, package, *where, "runs") for name, where in _MASTERS.items()},
        )


class _Package:
    """The scenario as a system structure for other masters, made at its first use."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._made = False

    def __call__(self) -> Path:
        if not self._made:
            sets = [word for change in CHANGES for word in ("--set", change)]
            command = [
                sys.executable,
                "-m",
                "cosim",
                "export",
                SCENARIO,
                *sets,
                "--to",
                "ssp",
                "--out",
                str(self._path),
            ]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode:
                raise NotMeasuredError(f"cosim export --to ssp: {' '.join(done.stderr.split())[-200:]}")
            self._made = True
        return self._path


def _system(environment: Environment, package: _Package, distribution: str, module: str, function: str) -> Entry:
    def entry(stack: ExitStack) -> Contestant:
        setup = {"ssp": str(package()), "step": STEP, "duration": RUN}
        return stack.enter_context(peer(environment, distribution, module, function, setup))

    return entry


def _master(*, record: bool) -> Entry:
    return lambda _: _Runs(record)


class _Runs:
    """Runs of the master, set up and closed outside the time."""

    def __init__(self, record: bool) -> None:
        self._record = record

    def seconds(self, count: int) -> float:
        """Do `count` steps, and return their time [s]."""
        scenario = load_scenario(SCENARIO, [*CHANGES, f"time.duration={count * STEP!r}"])
        with Master(scenario) as master, tempfile.TemporaryDirectory(prefix="benchmark-") as folder:
            recorders = [Recorder(Path(folder), master.signals.columns)] if self._record else []
            before = time.perf_counter()
            master.run(recorders)
            took = time.perf_counter() - before
            for recorder in recorders:
                recorder.close()
        return took


def flights(*, per_run: bool = True, changes: Sequence[str] = (), batch: int = BATCH, whole: bool = False) -> Entry:
    """Return the entry of the fused loop from many starts; an item is a run, a step, or a `whole` batch."""

    def entry(stack: ExitStack) -> Contestant:
        scenario = load_scenario(SCENARIO, [*CHANGES, f"time.duration={RUN}", *changes])
        flyer = stack.enter_context(FusedFlyer(Variation(scenario, ["initial.position.0"])))
        return _Flights(flyer, batch, 1.0 / batch if whole else 1.0 if per_run else float(scenario.steps))

    return entry


class _Flights:
    """Runs, each from its own start; times are scaled to the number of items in a run."""

    def __init__(self, flyer: FusedFlyer, batch: int, items: float) -> None:
        self._flyer, self._batch, self._items = flyer, batch, items

    def seconds(self, count: int) -> float:
        """Fly at least `count` items, and return the time of `count` of them [s]."""
        batches = math.ceil(count / self._items / self._batch)
        seeds = np.arange(self._batch)
        starts = np.random.default_rng(0).uniform(-0.2, 0.2, (batches, self._batch, 1))
        before = time.perf_counter()
        for some in starts:
            self._flyer.fly(some, seeds)
        return (time.perf_counter() - before) * count / (batches * self._batch * self._items)
