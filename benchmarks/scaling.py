"""Growth of the cost with obstacles, horizon, vehicles and workers."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import pairwise

from benchmarks.contest import Entry, entered
from benchmarks.contests.closed_loop import CHANGES, RUN, SCENARIO, flights
from benchmarks.contests.sweeps import sweep
from benchmarks.law import LawSteps
from benchmarks.machine import pinned
from benchmarks.table import Row, Table, format_time, with_base
from benchmarks.timing import Contestant, InProcess, Timing, fit_exponent, fit_line, take_turns
from cosim.scenario.scenario import load_scenario
from cosim.simulation.master import Master

RATIO = "how many times as long as the first of its table"
REPEATS = 5
OBSTACLES = (1, 3, 10, 30, 100)  # numbers of obstacles
HORIZONS = (10.0, 30.0, 100.0, 300.0)  # s, durations of runs
VEHICLES = (1, 8, 64, 512)  # numbers of vehicles in a batch
ROWS = 1_000  # number of rows of a sweep
LAWS = ("ismail_dunnigan", "deployable")
_SWEEPS = 3  # maximum number of repeats of a sweep


@dataclass(frozen=True)
class Curve:
    """Costs over sizes."""

    title: str  # description of an item
    of: str  # name of one unit of the size, such as ``obstacle``
    entries: Mapping[float, Entry]  # entries by size
    count: int | None = None  # items per repeat, if they are long

    def measure(self, budget: float, repeats: int) -> Table:
        """Time all sizes in turn, on one processor; the law of growth is in the notes."""
        with pinned(), ExitStack() as stack:
            contestants = [entered(entry, stack) for entry in self.entries.values()]
            timings = take_turns(contestants, budget, repeats, self.count)
        names = [self._name(size) for size in self.entries]
        rows = tuple(Row(name, timing, names[0], timings[0]) for name, timing in zip(names, timings, strict=True))
        return Table(self.title, rows, self._laws(timings))

    def _name(self, size: float) -> str:
        return f"{size:g} {self.of}{'s' if size != 1 else ''}"

    def _laws(self, timings: list[Timing | str]) -> tuple[str, ...]:
        """Return the laws of growth: the exponent of a power of the sizes, and the two coefficients of a line."""
        sizes = [size for size, one in zip(self.entries, timings, strict=True) if isinstance(one, Timing)]
        costs = [one.median for one in timings if isinstance(one, Timing)]
        if len(sizes) < 2:
            return ()
        parts = [fit_exponent(pair, cost) for pair, cost in zip(pairwise(sizes), pairwise(costs), strict=True)]
        between = ", ".join(f"{x:.2f}" for x in parts)
        power = f"exponent {fit_exponent(sizes, costs):.2f}; from one size to the next {between}"
        if len(sizes) < 3:
            return (power,)
        fixed, per_unit, off = fit_line(sizes, costs)
        return (
            power,
            f"about {format_time(fixed)} and {format_time(per_unit)} for each {self.of}, to {100 * off:.0f} %",
        )


@dataclass(frozen=True)
class SweepComparison:
    """Costs of one sweep by several kinds of workers."""

    title: str  # description of an item
    entries: Mapping[str, Entry]  # entries by name, that of one worker first
    rows: int  # number of rows of the sweep

    def measure(self, budget: float, repeats: int) -> Table:
        """Time all entries in turn, on all processors; the speedups over the first are in the notes."""
        with ExitStack() as stack:
            contestants = [entered(entry, stack) for entry in self.entries.values()]
            timings = take_turns(contestants, budget, min(repeats, _SWEEPS), self.rows)
        first, *others = with_base(dict(zip(self.entries, timings, strict=True)))
        notes = tuple(f"{row.name}: {1.0 / row.ratio:.2f} times as fast as {first.name}" for row in others if row.ratio)
        return Table(self.title, (first, *others), notes)


def measure(subjects: list[str], budget: float, repeats: int) -> list[Table]:
    """Time the curves of some subjects; budget [s] of a repeat of each size."""
    tables = []
    for subject in subjects:
        for curve in SUBJECTS[subject]():
            print(curve.title, file=sys.stderr, flush=True)
            tables.append(curve.measure(budget, repeats))
    return tables


def obstacles() -> Iterator[Curve]:
    """Yield the growth of a law's step, and of a step of the fused loop, with obstacles."""
    for law in LAWS:
        entries: dict[float, Entry] = {n: lambda _, law=law, n=n: LawSteps(law, int(n)) for n in OBSTACLES}
        yield Curve(f"A step of the law {law!r}", "obstacle", entries)
    entries = {n: flights(per_run=False, changes=_with_obstacles(int(n))) for n in OBSTACLES}
    yield Curve("A step of the closed loop, fused loop", "obstacle", entries)


def horizon() -> Iterator[Curve]:
    """Yield the growth of a run with the simulated time."""
    yield Curve("A run, master without record", "second", {t: _run(t) for t in HORIZONS}, count=1)
    entries: dict[float, Entry] = {t: flights(changes=(f"time.duration={t}",)) for t in HORIZONS}
    yield Curve("A run, fused loop", "second", entries)


def vehicles() -> Iterator[Curve]:
    """Yield the growth of a batch with the vehicles in it."""
    entries: dict[float, Entry] = {n: flights(batch=int(n), whole=True) for n in VEHICLES}
    yield Curve(f"A batch of runs of {RUN:g} s, fused loop", "vehicle", entries)


def workers() -> Iterator[SweepComparison]:
    """Yield the sweeps with one and two workers, in processes or in Dask."""
    entries = {
        f"{n} {worker}": sweep(pool, n)
        for pool, n, worker in (
            ("processes", 1, "process"),
            ("processes", 2, "processes"),
            ("Dask", 1, "in Dask"),
            ("Dask", 2, "in Dask"),
        )
    }
    yield SweepComparison(f"A run of {RUN:g} s in a sweep of {ROWS}, fused loop", entries, ROWS)


SUBJECTS: dict[str, Callable[[], Iterator[Curve] | Iterator[SweepComparison]]] = {
    "obstacles": obstacles,
    "horizon": horizon,
    "vehicles": vehicles,
    "workers": workers,
}


def _with_obstacles(n: int) -> tuple[str, ...]:
    """Return the changes that replace all regions by n spheres of the criterion "obstacle" beside the path."""
    balls = []
    for i in range(n):
        center = [8.0 * (i + 1) / (n + 1), 3.0 if i % 2 else -3.0, 3.0]
        shape = f'{{type = "sphere", center = {center}, radius = 0.5}}'
        balls.append(f'{{name = "O{i}", criterion = "obstacle", keep = "out", gain = 100.0, shape = {shape}}}')
    return (f"regions=[{', '.join(balls)}]", "intersection=[]")


def _run(duration: float) -> Entry:
    def entry(_: ExitStack) -> Contestant:
        scenario = load_scenario(SCENARIO, [*CHANGES, f"time.duration={duration}"])

        def work(count: int) -> None:
            for _ in range(count):
                with Master(scenario) as master:
                    master.run()

        return InProcess(work)

    return entry
