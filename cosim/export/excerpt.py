"""Selection of the signals and steps of a run for export."""

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
from cosim.results.system_run import SystemRun, is_of_system, load_system_run
from cosim.simulation.signals import Column
from plant_fmu.toml_tables import MAX_COMPARED

_ROUNDING = 1e-6  # periods, tolerance of the comparison of times and ticks


@dataclass(frozen=True)
class Excerpt:
    """A run with the selection of its signals and steps."""

    source: Run | SystemRun
    indices: tuple[int, ...]  # indices of the signals in a row of the record, rising, `time` included
    every: int  # export every n-th step, from the first one on
    rate: float | None = None  # Hz, steps per simulated second instead of `every`

    @property
    def run(self) -> Run:
        """The run of a scenario; raise `ExportError` if it is that of a system of FMUs."""
        if isinstance(self.source, SystemRun):
            raise ExportError(
                f"{self.source.folder}: holds a run of a system of FMUs, which has no known vehicle; "
                "expected --to csv or mcap with it"
            )
        return self.source

    @property
    def columns(self) -> tuple[Column, ...]:
        """Columns of the selected signals, in the order of the record."""
        return tuple(self.source.record.columns[i] for i in self.indices)

    @property
    def texts(self) -> dict[str, str]:
        """Scenario file of the run folder, and summary as JSON with null for NaN and infinity, by file name."""
        summary = {"summary.json": json_text(self.source.summary)}
        if isinstance(self.source, SystemRun):
            return summary
        return {"scenario.toml": (self.source.folder / SCENARIO).read_text(encoding="utf-8")} | summary

    @cached_property
    def count(self) -> int:
        """Number of exported steps."""
        return sum(len(block) for block in self.blocks(["time"]))

    def blocks(self, names: Sequence[str] | None = None) -> Iterator[Rows]:
        """Yield the exported steps with the signals `names`, default all, in blocks that fit into memory."""
        first, began, tick = 0, None, -1.0
        for block in self.source.record.blocks(names if names is None or self.rate is None else ["time", *names]):
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
        """Return a selection of the exported steps; `steps` are indices among them, rising, from 0."""
        parts: list[Rows] = []
        first = 0
        for block in self.blocks(names):
            parts.append(block.take(steps[(steps >= first) & (steps < first + len(block))] - first))
            first += len(block)
        return Rows(parts[0].columns, {name: np.concatenate([rows[name] for rows in parts]) for name in names})


def excerpt_of(folder: Path, signals: Sequence[str] = (), every: int = 1, rate: float | None = None) -> Excerpt:
    """Select signals and steps of a run for export; rate [Hz]."""
    run = load_system_run(folder) if is_of_system(folder) else load_run(folder)
    names = [column.name for column in run.record.columns]
    selected = (
        {name for pattern in signals for name in _match_names(pattern, names)} | {"time"} if signals else {*names}
    )
    return Excerpt(run, tuple(i for i, name in enumerate(names) if name in selected), every, rate)


def _match_names(pattern: str, names: Sequence[str]) -> list[str]:
    # exact names first: in a pattern, the brackets of thrust[1] would be a character class
    matching = [name for name in names if name == pattern] or [name for name in names if fnmatchcase(name, pattern)]
    if not matching:
        near = difflib.get_close_matches(pattern[:MAX_COMPARED], names, n=3, cutoff=0.0)
        raise ExportError(f"--signals {pattern}: matches no signal of the run; expected such as {', '.join(near)}")
    return matching
