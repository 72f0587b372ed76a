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
from benchmarks.table import Row, Table, compared, figure
from benchmarks.timing import Contestant, Own, Timing, growth, straight, take_turns
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
    """Costs over sizes.

    Attributes
    ----------
    title : str
        Description of an item.
    of : str
        Name of one unit of the size, such as ``obstacle``.
    entries : mapping from float to Entry
        Entries by size.
    count : int, optional
        Items per repeat, if the items are long.
    """

    title: str
    of: str
    entries: Mapping[float, Entry]
    count: int | None = None

    def measure(self, budget: float, repeats: int) -> Table:
        """Time all sizes in turn, on one processor; the law of growth is in the notes."""
        with pinned(), ExitStack() as stack:
            contestants = [entered(entry, stack) for entry in self.entries.values()]
            found = take_turns(contestants, budget, repeats, self.count)
        names = [self._name(size) for size in self.entries]
        rows = tuple(Row(name, timing, names[0], found[0]) for name, timing in zip(names, found, strict=True))
        return Table(self.title, rows, self._laws(found))

    def _name(self, size: float) -> str:
        return f"{size:g} {self.of}{'s' if size != 1 else ''}"

    def _laws(self, found: list[Timing | str]) -> tuple[str, ...]:
        """Return the laws of growth: the exponent of a power of the sizes, and the two coefficients of a line."""
        sizes = [size for size, one in zip(self.entries, found, strict=True) if isinstance(one, Timing)]
        costs = [one.median for one in found if isinstance(one, Timing)]
        if len(sizes) < 2:
            return ()
        parts = [growth(pair, cost) for pair, cost in zip(pairwise(sizes), pairwise(costs), strict=True)]
        power = f"exponent {growth(sizes, costs):.2f}; from one size to the next {', '.join(f'{x:.2f}' for x in parts)}"
        if len(sizes) < 3:
            return (power,)
        fixed, each, off = straight(sizes, costs)
        return (power, f"about {figure(fixed)} and {figure(each)} for each {self.of}, to {100 * off:.0f} %")


@dataclass(frozen=True)
class SweepComparison:
    """Costs of one sweep by several kinds of workers.

    Attributes
    ----------
    title : str
        Description of an item.
    entries : mapping from str to Entry
        Entries by name, that of one worker first.
    rows : int
        Rows of the sweep.
    """

    title: str
    entries: Mapping[str, Entry]
    rows: int

    def measure(self, budget: float, repeats: int) -> Table:
        """Time all entries in turn, on all processors; the speedups over the first are in the notes."""
        with ExitStack() as stack:
            contestants = [entered(entry, stack) for entry in self.entries.values()]
            found = take_turns(contestants, budget, min(repeats, _SWEEPS), self.rows)
        first, *others = compared(dict(zip(self.entries, found, strict=True)))
        notes = tuple(f"{row.name}: {1.0 / row.ratio:.2f} times as fast as {first.name}" for row in others if row.ratio)
        return Table(self.title, (first, *others), notes)


def measure(subjects: list[str], budget: float, repeats: int) -> list[Table]:
    """Time the curves of some subjects.

    Parameters
    ----------
    subjects : list of str
        Names of subjects in `SUBJECTS`.
    budget : float
        Time of a repeat of each size [s].
    repeats : int
        Number of repeats.

    Returns
    -------
    list of Table
        A table for each curve.
    """
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

        return Own(work)

    return entry
