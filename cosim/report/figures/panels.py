"""Figures over time as panels below each other, each of lines, and beside each other for spans of time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from cosim.report.figures.broken_time import break_time, rests_from
from cosim.report.figures.layout import legend, limits_of, panel_grid, symlog_axis
from cosim.report.figures.style import BLACK, RED, FigureData, thin
from cosim.simulation.signals import Array

DASHES = ("-", "--", "-.", ":")
_MAX_WINDOWS = 3  # maximum number of windows of overlap that are shown
_WIDER = 1.6  # end of the enlarged span, relative to the end of the first overlap


class Line(NamedTuple):
    """A signal, or a level across the panel."""

    label: str
    signal: Array | float
    style: dict[str, Any]


class Panel(NamedTuple):
    """Axes with their lines."""

    ylabel: str
    height: float  # inches
    lines: Sequence[Line]
    scale: Callable[[Axes], object]  # sets the limits of the y axis
    violated: float = 0.0  # sign of the values that are violations, on red; 0: none


class Column(NamedTuple):
    """A span of time, shown by a column of axes."""

    start: float  # s
    end: float  # s
    width: float = 1.0  # relative to other columns
    overlap: tuple[float, float] | None = None  # s, window of overlap, on gray
    title: str = ""


def overlap_columns(data: FigureData) -> list[Column]:
    """Return the spans around the first windows of overlap."""
    columns, time = [], data.record["time"]
    for start, end in data.summary["intersection_windows"][:_MAX_WINDOWS]:
        margin = max(0.5 * (end - start), 5 * data.scenario.time.step)
        title = f"{start:.3f} s to {end:.3f} s"
        limits = max(start - margin, float(time[0])), min(end + margin, float(time[-1]) + 1e-9)
        columns.append(Column(*limits, overlap=(start, end), title=title))
    return columns


def zoom_columns(data: FigureData) -> list[Column]:
    """Return the whole run, behind the time of the first overlap if figures over the whole run would not show it."""
    windows, end = data.summary["intersection_windows"], data.summary["simulated_time"]
    if windows and 0.0 < _WIDER * windows[0][1] <= 0.4 * end:
        return [Column(0.0, _WIDER * windows[0][1], 2.0, tuple(windows[0])), Column(0.0, end, 3.0)]
    return []


def draw_panels(data: FigureData, panels: Sequence[Panel], columns: Sequence[Column] = ()) -> Figure:
    """Draw panels over some spans of time, or over the whole run, where a break in time shortens an early rest."""
    whole = Column(0.0, data.summary["simulated_time"] or data.scenario.time.step)
    columns, lines = columns or [whole], [line for panel in panels for line in panel.lines]
    lines.sort(key=lambda line: isinstance(line.signal, float))  # levels last
    has_titles = bool(columns[0].title)
    labels = dict.fromkeys([*(line.label for line in lines if line.label), *(["overlap"] if has_titles else [])])
    widths = [column.width for column in columns]
    figure, axes = panel_grid([panel.height for panel in panels], widths, list(labels), 0.2 if has_titles else 0.0)
    entries: dict[str, Artist] = {}
    for column, below in zip(columns, axes.T, strict=True):
        below[0].set_xlim(column.start, column.end)
        below[0].xaxis.set_major_locator(
            MaxNLocator(min(8, round(10 * column.width / sum(widths))), steps=[1, 2, 5, 10])
        )
        below[0].set_title(column.title, fontsize=8, pad=3)
        below[-1].set_xlabel("time [s]")
        for ax in below:
            if column.overlap:
                entries["overlap"] = ax.axvspan(*column.overlap, color=BLACK, alpha=0.08, linewidth=0)
    if columns == [whole] and (rest := rests_from(data.record)) is not None:
        break_time(axes[:, 0], rest, columns[0].end)
    for row, panel in zip(axes, panels, strict=True):
        for line in panel.lines:
            for ax in row:
                entries[line.label] = _draw_line(ax, data, line)
        panel.scale(row[0])
        limits = row[0].get_ylim()
        for ax in row if panel.violated else ():
            ax.axhspan(0.0, limits[panel.violated > 0.0], color=RED, alpha=0.06, linewidth=0)
            ax.axhline(0.0, color=BLACK, linewidth=0.8)
        row[0].set_ylim(limits)
        row[0].set_ylabel(panel.ylabel)
    legend(figure, {label: entries[label] for label in labels})
    return figure


def _draw_line(ax: Axes, data: FigureData, line: Line) -> Artist:
    if isinstance(line.signal, float):
        return ax.axhline(line.signal, **line.style)
    time = data.record["time"]
    first, last = np.searchsorted(time, ax.get_xlim())
    shown = slice(max(0, first - 1), last + 1)
    marker = "o" if len(time) == 1 else ""
    (drawn,) = ax.plot(*thin(time[shown], line.signal[shown]), marker=marker, markersize=4, **line.style)
    return drawn


# ---- scales ----


def fit(signals: Sequence[Array], min_spread: float = 0.0) -> Callable[[Axes], object]:
    """Return a linear scale that contains all values."""
    return lambda ax: ax.set_ylim(*limits_of(signals, min_spread=min_spread))


def fit_spikes(
    signals: Sequence[Array],
    largest: float,
    typical: float,
    linear: float,
    ratio: float = 20.0,
    min_spread: float = 0.0,
) -> Callable[[Axes], object]:
    """Return a linear scale, or one that is logarithmic beyond `linear`, where a spike would hide typical values."""
    if largest > ratio * max(typical, 1.0):
        return lambda ax: symlog_axis(ax, largest, linear)
    return fit(signals, min_spread)


def percentile(signal: Array, q: float) -> float:
    """Return a percentile of the finite magnitudes of a signal; 0 if there are none."""
    sizes = np.abs(signal[np.isfinite(signal)])
    return float(np.percentile(sizes, q)) if sizes.size else 0.0
