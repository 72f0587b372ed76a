"""What of a run is exported: which of its signals, at which of its steps."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cosim.errors import ExportError
from cosim.io.strict_json import json_text
from cosim.results.record import Rows
from cosim.results.run_result import SCENARIO, Run, load_run
from cosim.simulation.signals import Array, Column

_ROUNDING = 1e-6  # of a period; a time that is short of a tick by no more has reached it


@dataclass(frozen=True)
class Excerpt:
    """A run, and what of it is exported."""

    run: Run
    picked: tuple[int, ...]  # places of the signals in a row of the record, rising, `time` always among them
    every: int  # one step of so many, from the first one on,
    rate: float | None = None  # or as many steps a simulated second [Hz]

    @property
    def columns(self) -> tuple[Column, ...]:
        """The signals, in the order of the record."""
        return tuple(self.run.record.columns[i] for i in self.picked)

    @property
    def scenario_text(self) -> str:
        """The scenario as it stands in the run folder."""
        return (self.run.folder / SCENARIO).read_text(encoding="utf-8")

    @property
    def summary_text(self) -> str:
        """The summary as JSON, null where a number is none."""
        return json_text(self.run.summary)

    @cached_property
    def count(self) -> int:
        """How many steps are exported."""
        return sum(len(block) for block in self.blocks(["time"]))

    def blocks(self, names: Sequence[str] | None = None) -> Iterator[Rows]:
        """Yield the exported steps, in blocks that fit into memory; by default with all signals of the record."""
        first, began, tick = 0, None, -1.0
        for block in self.run.record.blocks(names if names is None or self.rate is None else ["time", *names]):
            if self.rate is None:
                here = np.arange(-first % self.every, len(block), self.every)
            else:
                began = block["time"][0] if began is None else began
                ticks = np.floor((block["time"] - began) * self.rate + _ROUNDING)
                here = np.flatnonzero(np.diff(ticks, prepend=tick) > 0.0)
                tick = ticks[-1]
            if here.size:
                yield block.take(here, names)
            first += len(block)

    def take(self, steps: NDArray[np.intp], names: Sequence[str]) -> Rows:
        """Return some of the exported steps, rising, from 0."""
        found: list[Rows] = []
        first = 0
        for block in self.blocks(names):
            found.append(block.take(steps[(steps >= first) & (steps < first + len(block))] - first))
            first += len(block)
        return Rows(found[0].columns, {name: np.concatenate([rows[name] for rows in found]) for name in names})

    def signal(self, name: str) -> Array:
        """Return any signal of the record at all exported steps."""
        return np.concatenate([block[name] for block in self.blocks([name])])


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
    return Excerpt(run, tuple(i for i, name in enumerate(names) if name in wanted), every, rate)


def _fitting(pattern: str, names: Sequence[str]) -> list[str]:
    # a name is taken as it is first: the brackets of thrust[1] would mean something else in a pattern
    fitting = [name for name in names if name == pattern] or [name for name in names if fnmatchcase(name, pattern)]
    if not fitting:
        near = difflib.get_close_matches(pattern, names, n=3, cutoff=0.0)
        raise ExportError(f"--signals {pattern}: fits no signal of the run; expected such as {', '.join(near)}")
    return fitting
