"""Selection of the rows from which figures are drawn: all of a short record, significant ones of a long record."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from cosim.report.figures.panels import overlap_columns, zoom_columns
from cosim.report.figures.style import FigureData
from cosim.report.figures.time_series import error_of, norms_of, thrusts_of
from cosim.results.extremes import even_edges, extreme_rows, rows_at
from cosim.results.record import Rows
from cosim.results.required_columns import REGION_COLUMNS
from cosim.results.run_result import Run
from cosim.scenario.scenario import Scenario
from cosim.simulation.signals import Array

_MAX_WHOLE_ROWS = 200_000  # maximum number of rows of a record that is used as a whole
_MAX_SAMPLED_ROWS = 80_000  # maximum number of rows with extremes
_EVEN = 20_000  # number of evenly spaced rows
_DRAWN = (
    "time", "position.", "quaternion.", "velocity.", "attitude.", "membership.", "weight.", "estimate.", "command.",
    "actuation.", "thruster_force[", "commands.", "target.", "lyapunov.",
)  # fmt: skip
_EXTREME = ("attitude.", "membership.", "weight.", "estimate.", "lyapunov.")


def make_figure_data(run: Run) -> FigureData:
    """Select the rows from which the figures of a run are drawn."""
    # From a long record, these are the rows with the minimum and maximum of each drawn signal in each of some hundred
    # parts of the run and of the enlarged spans, and rows evenly spaced in time.
    data = FigureData(run.scenario, run.record, run.summary)
    if len(run.record) <= _MAX_WHOLE_ROWS:
        return data
    names = [name for name in run.record.units if name.startswith(_DRAWN) or name.endswith(REGION_COLUMNS)]
    return dataclasses.replace(data, record=run.record.take(_rows(data, names), names))


def _rows(data: FigureData, names: list[str]) -> NDArray[np.intp]:
    """Return the selected rows of a long record."""
    scenario, record = data.scenario, data.record
    n, enlarged = len(record), [*overlap_columns(data), *zoom_columns(data)[:1]]
    bounds = rows_at(record, [time for span in enlarged for time in (span.start, span.end)]).clip(0, n - 1)
    signals = len(_signals_with_extremes(scenario, record.take([0], names)))
    parts = max(1, _MAX_SAMPLED_ROWS // (2 * signals * (1 + len(enlarged))))
    edges = [even_edges(n, parts)]
    edges += [first + even_edges(end - first, parts) for first, end in bounds.reshape(-1, 2)]
    blocks = (_signals_with_extremes(scenario, block) for block in record.blocks(names))
    extremes = extreme_rows(blocks, signals, np.unique(np.concatenate(edges)))
    even = np.linspace(0, n - 1, _EVEN).astype(np.intp)
    return np.unique(np.concatenate([even, bounds, extremes]))


def _signals_with_extremes(scenario: Scenario, rows: Rows) -> list[Array]:
    """Return the signals whose extremes the figures must show."""
    names = [name for name in rows.units if name.startswith(_EXTREME) or name.endswith(REGION_COLUMNS)]
    names += [f"actuation.{axis}" for axis in "XYZ"]
    _, error = error_of(scenario, rows)
    return [*(rows[name] for name in names), error, *norms_of(rows).values(), *thrusts_of(scenario, rows).T]
