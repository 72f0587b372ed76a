"""What of a run is exported: which of its signals, at which of its steps."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cosim.errors import ExportError
from cosim.flown_run import SCENARIO, FlownRun, load_run
from cosim.plain_json import json_text
from cosim.signals import Array, Column

_ROUNDING = 1e-6  # of a period; a time that is short of a tick by no more has reached it


@dataclass(frozen=True)
class Excerpt:
    """A run, and what of it is exported."""

    run: FlownRun
    picked: tuple[int, ...]  # places of the signals in a row of the record, rising, `time` always among them
    rows: NDArray[np.intp]  # rising; the first one always among them

    @property
    def columns(self) -> tuple[Column, ...]:
        """The signals, in the order of the record."""
        return tuple(self.run.record.columns[i] for i in self.picked)

    @property
    def scenario_text(self) -> str:
        """The scenario as it stands in the run folder."""
        return (self.run.path / SCENARIO).read_text(encoding="utf-8")

    @property
    def summary_text(self) -> str:
        """The summary as JSON, null where a number is none."""
        return json_text(self.run.summary)

    def signal(self, name: str) -> Array:
        """Return any signal of the record at the exported steps."""
        return self.run.record[name][self.rows]

    def blocks(self) -> Iterator[Array]:
        """Yield the exported steps with all signals of the record, in blocks that fit into memory."""
        first = 0
        for block in self.run.record.blocks():
            here = self.rows[np.searchsorted(self.rows, first) : np.searchsorted(self.rows, first + len(block))]
            if here.size:
                yield block[here - first]
            first += len(block)


def excerpt_of(folder: Path, signals: Sequence[str] = (), every: int = 1, rate: float | None = None) -> Excerpt:
    """Return what of a run is exported.

    Parameters
    ----------
    folder : Path
        The run folder, of a run that was finished, interrupted or killed.
    signals : sequence of str
        Names or patterns such as ``*.clearance``; none for all.
    every : int
        One step of so many.
    rate : float, optional
        Steps a simulated second [Hz] in the place of `every`; all where the record has fewer.

    Returns
    -------
    Excerpt
        With the time, whatever the patterns are.

    Raises
    ------
    RunError
        If the folder holds no run that can be read.
    ExportError
        If a pattern fits no signal.
    """
    run = load_run(folder)
    names = [column.name for column in run.record.columns]
    wanted = {name for pattern in signals for name in _fitting(pattern, names)} | {"time"} if signals else {*names}
    time = run.record["time"]
    if rate is None:
        rows = np.arange(0, len(time), every)
    else:
        ticks = np.floor((time - time[0]) * rate + _ROUNDING)
        rows = np.flatnonzero(np.diff(ticks, prepend=-1.0) > 0.0)
    picked = tuple(i for i, name in enumerate(names) if name in wanted)
    return Excerpt(run, picked, rows)


def _fitting(pattern: str, names: Sequence[str]) -> list[str]:
    # a name is taken as it is first: the brackets of thrust[1] would mean something else in a pattern
    fitting = [name for name in names if name == pattern] or [name for name in names if fnmatchcase(name, pattern)]
    if not fitting:
        near = difflib.get_close_matches(pattern, names, n=3, cutoff=0.0)
        raise ExportError(f"--signals {pattern}: fits no signal of the run; expected such as {', '.join(near)}")
    return fitting
