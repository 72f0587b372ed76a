"""Layout of figures: axes, legend and labels at fixed positions, which needs no layout engine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, MaxNLocator, NullLocator

from cosim.report.figures.style import STYLE
from cosim.simulation.signals import Array

WIDTH = 6.8  # inches, width of every figure
LEFT, RIGHT, BOTTOM, TOP = 0.80, 0.14, 0.46, 0.10  # inches around the axes
LEGEND_ROW = 0.19  # inches, height of a row
_GAP = 0.14  # inches between axes
_MARGIN = 0.06  # margin beyond signals, as a fraction of their span
_LABEL = 0.17  # inches from the figure's edge to the center of an axis label
_MAX_LETTERS = 34  # maximum number of letters of a name in a legend
_LETTERS, _MARK = 104, 7  # widths in letters of a legend: width of the figure; width of a line with its gap

# names are given by users: their $ and _ are not mathematics
FIGURE_STYLE: Any = (
    STYLE | {"text.parse_math": False} | dict.fromkeys(("axes.labelsize", "xtick.labelsize", "ytick.labelsize"), 8)
)

_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def new_figure(height: float) -> Figure:
    """Create a figure of a height [inch] and the width `WIDTH`."""
    return Figure(figsize=(WIDTH, height))


def panel_grid(
    heights: Sequence[float], widths: Sequence[float], labels: Sequence[str], titles: float
) -> tuple[Figure, Any]:
    """Create a figure and its axes; axes of a column share their x axis, and those of a row their y axis."""
    # Units of arguments: heights [inch]; titles [inch]
    top = TOP + LEGEND_ROW * legend_rows(labels) + titles
    total = top + sum(heights) + _GAP * (len(heights) - 1) + BOTTOM
    figure = new_figure(total)
    wide = (WIDTH - LEFT - RIGHT - _GAP * (len(widths) - 1)) * np.array(widths) / sum(widths)
    axes = np.empty((len(heights), len(widths)), dtype=object)
    y = total - top
    for i, height in enumerate(heights):
        y -= height
        x = LEFT
        for j, width in enumerate(wide):
            beside = axes[i, 0] if j else None
            box = (x / WIDTH, y / total, width / WIDTH, height / total)
            ax = figure.add_axes(box, sharex=axes[0, j] if i else None, sharey=beside)
            plain_numbers(ax)
            ax.tick_params(labelbottom=i == len(heights) - 1, labelleft=not j, length=3)
            ax.yaxis.set_label_coords((_LABEL - LEFT) / width, 0.5)
            ax.xaxis.set_label_coords(0.5, (_LABEL - BOTTOM) / height)
            axes[i, j] = ax
            x += width + _GAP
        y -= _GAP
    return figure, axes


def plain_numbers(ax: Axes) -> None:
    """Set few ticks at round numbers, without exponents."""
    for axis, max_ticks in ((ax.xaxis, 8), (ax.yaxis, 5)):
        axis.set_major_locator(MaxNLocator(max_ticks, steps=[1, 2, 2.5, 5, 10]))
        axis.set_major_formatter(FuncFormatter(format_tick))


def format_tick(value: float, _: object = None) -> str:
    """Format a number for an axis."""
    return f"{value:.6g}".replace("-", "−") if value else "0"


def log_axis(ax: Axes, signals: Sequence[Array]) -> None:
    """Make the y axis logarithmic, with powers of ten as tick labels, to show signals above 0."""
    ax.set_yscale("log")
    ax.yaxis.set_major_locator(LogLocator(numticks=6))
    ax.yaxis.set_minor_locator(NullLocator())
    ax.yaxis.set_major_formatter(FuncFormatter(_power))
    low, high = limits_of([np.log10(signal) for signal in signals])
    if np.floor(high) - np.ceil(low) < 1.0:  # the axis has to span two powers of ten
        low, high = np.floor(low), max(np.ceil(high), np.floor(low) + 1.0)
    ax.set_ylim(10.0**low, 10.0**high)


def symlog_axis(ax: Axes, largest: float, linear: float) -> None:
    """Make the y axis linear to about `linear` and logarithmic beyond, up to `largest`."""
    threshold = 10.0 ** np.ceil(np.log10(linear))
    decades = 10.0 ** np.arange(np.log10(threshold), np.ceil(np.log10(largest)) + 1.0)
    decades = decades[:: int(np.ceil(len(decades) / 3))]
    ax.set_yscale("symlog", linthresh=threshold)
    ax.yaxis.set_major_locator(FixedLocator([*-decades[::-1], 0.0, *decades]))
    ax.yaxis.set_minor_locator(NullLocator())
    ax.yaxis.set_major_formatter(FuncFormatter(_power))
    ax.set_ylim(-1.5 * largest, 1.5 * largest)


def _power(value: float, _: object = None) -> str:
    if not value:
        return "0"
    power = round(float(np.log10(abs(value))))
    number = f"{10.0**power:g}" if -2 <= power <= 3 else "10" + str(power).translate(_SUPERSCRIPT)
    return f"{'−' if value < 0.0 else ''}{number}"


def limits_of(signals: Sequence[Array], *, min_spread: float = 0.0) -> tuple[float, float]:
    """Return limits of an axis that contain all values of signals."""
    finite = [s[np.isfinite(s)] for s in map(np.asarray, signals)]
    shown = np.concatenate([f for f in finite if f.size] or [np.array([-1.0, 1.0])])
    low, high = float(shown.min()), float(shown.max())
    spread = max(high - low, min_spread, 1e-9 * max(abs(low), abs(high)), 1e-12)
    extra = (spread - (high - low)) / 2.0 + _MARGIN * spread
    return low - extra, high + extra


def short(name: str) -> str:
    """Shorten a name for a legend."""
    return name if len(name) <= _MAX_LETTERS else name[: _MAX_LETTERS - 1].rstrip() + "…"


def _rows_of(labels: Sequence[str], across: float = _LETTERS) -> list[list[str]]:
    """Arrange labels in rows of about the same length that fit the width of a figure."""
    rows: list[list[str]] = []
    columns_left = 0.0
    for label in labels:
        letters = len(short(label)) + _MARK
        if letters > columns_left:
            rows.append([])
            columns_left = across
        rows[-1].append(label)
        columns_left -= letters
    even = 1.1 * sum(len(short(label)) + _MARK for label in labels) / max(1, len(rows))
    if len(rows) > 1 and even < across:
        evened = _rows_of(labels, even)
        return evened if len(evened) == len(rows) else rows
    return rows


def legend_rows(labels: Sequence[str]) -> int:
    """Return the number of rows of a legend with these labels."""
    return len(_rows_of(labels))


def legend(figure: Figure, entries: Mapping[str, Artist]) -> None:
    """Add a legend above all axes, also for names that begin with _, which Matplotlib would omit."""
    height = figure.bbox.height / figure.dpi
    for i, row in enumerate(_rows_of(list(entries))):
        row_legend = figure.legend(
            [entries[label] for label in row], ["x"] * len(row), ncols=len(row), loc="upper center", fontsize=8,
            bbox_to_anchor=(0.0, 1.0 - (0.04 + i * LEGEND_ROW) / height, 1.0, 0.0), borderpad=0.0, borderaxespad=0.0,
            handlelength=1.8, handletextpad=0.5, columnspacing=1.4,
        )  # fmt: skip
        for text, label in zip(row_legend.get_texts(), row, strict=True):
            text.set_text(short(label))
