"""Figures of campaigns: rates with their intervals, distributions, and outcomes over varied keys."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter, PercentFormatter

from cosim.campaigns.analysis.statistics import Facts, bins, quantiles, rate
from cosim.campaigns.pages.sections import LABELS
from cosim.campaigns.store.results import Results
from cosim.report.figures.style import BLACK, BLUE, CYCLE, GREEN, ORANGE, RED, NamedFigure
from cosim.simulation.signals import Array

WIDTH = 5.6  # in, width of a figure, which is readable on a phone too
_PANELS_PER_ROW = 2  # number of panels per row
_MAX_KEYS = 8  # maximum number of keys that are drawn
_POINTS = 700  # maximum number of points in a panel
_TICKS = 5  # maximum number of intervals across a panel, so that labels of five digits fit
_WIDE = 30.0  # ratio of a logarithmic range from which on only powers of ten have ticks
_STEPS = 400  # maximum number of steps of a drawn distribution
_DASHES = ("-", "--", "-.", ":")
_LETTERS, _MARK = 100, 7  # widths in letters of a legend 6.4 in wide: the legend; a line or marker
_MAX_SCENES = 1500  # maximum number of scenes that are drawn one by one
_NEVER = 1.12  # distance of missing numbers from the minimum number, as a multiple of the range of the numbers

FACT_COLORS = {"completed": BLUE, "reached": GREEN, "settled": BLUE, "violation": RED, "violated": RED}
_MARKS = {"completed": "D", "reached": "o", "settled": "D", "violation": "s", "violated": "s"}


class Rated(NamedTuple):
    """A line of a forest plot."""

    fact: str  # name of the outcome, one of `FACT_COLORS`
    group: str  # name of the group of rows; "" if there is only one
    rows: int  # number of rows in the group
    rate: dict[str, Any]  # result of `cosim.campaigns.analysis.statistics.rate`


class Key(NamedTuple):
    """A key that varies over the rows."""

    label: str  # label of the axis, with unit
    values: Array  # (n,) value in each row
    log: bool = False  # True: drawn on a logarithmic scale


def forest(lines: Sequence[Rated]) -> Figure:
    """Draw rates as markers with their 95 % intervals, a line each, under a heading for each fact."""
    heads = len({line.fact for line in lines if line.group})
    figure = Figure(figsize=(WIDTH, 0.75 + 0.27 * (len(lines) + heads)), layout="constrained")
    axes = figure.add_subplot()
    y, ticks, labels, before = 0.0, [], [], None
    for line in lines:
        if line.group and line.fact != before:
            ticks.append(y)
            labels.append(f"$\\bf{{{line.fact}}}$")
            y += 1.0
        before = line.fact
        ticks.append(y)
        labels.append(f"{line.group or line.fact}  ({line.rate['rows']} of {line.rows})")
        _interval(axes, line, y)
        y += 1.0
    axes.set(xlim=(-0.02, 1.02), ylim=(y - 0.4, -0.6), xlabel="share of all, 95 % interval by Wilson")
    axes.set_yticks(ticks, labels)
    axes.tick_params(axis="y", length=0)
    axes.xaxis.set_major_formatter(PercentFormatter(1.0))
    axes.grid(visible=False, axis="y")
    return figure


def _interval(axes: Axes, line: Rated, y: float) -> None:
    share = line.rate["share"]
    if share is None:
        return
    color = FACT_COLORS[line.fact]
    axes.hlines(y, line.rate["low"], line.rate["high"], color=color, linewidth=2.2)
    axes.plot(share, y, _MARKS[line.fact], color=color, markersize=6, clip_on=False)
    text = f"{100 * share:.1f} %"
    right = line.rate["high"] < 0.86
    axes.annotate(
        text, (line.rate["high"] if right else line.rate["low"], y), (7 if right else -7, 0),
        textcoords="offset points", ha="left" if right else "right", va="center", fontsize=8,
    )  # fmt: skip


def distributions(columns: Mapping[str, Mapping[str, Array]], addition: str) -> Iterator[NamedFigure]:
    """Yield the figure of empirical distributions, a panel for each column, with a dot at the median; columns (n,)."""
    drawn = {name: groups for name, groups in columns.items() if any(np.isfinite(x).any() for x in groups.values())}
    if not drawn:
        return
    figure, panels = _panels(len(drawn), 2.3)
    for axes, (column, groups) in zip(panels, drawn.items(), strict=True):
        for i, (name, values) in enumerate(groups.items()):
            x, shares = _thin(*cumulative_fractions(values))
            color, dash = CYCLE[i % len(CYCLE)], _DASHES[i % len(_DASHES)]
            axes.step(x, shares, where="post", color=color, linestyle=dash, label=name)
            median = quantiles(values)["0.5"]
            if median is not None:  # at half of the share of existing numbers
                axes.plot(median, shares[-1] / 2.0, "o", color=color, markersize=5)
        if column == "min_clearance":
            axes.axvline(0.0, color=BLACK, linewidth=0.8)
        axes.set(xlabel=LABELS[column], ylim=(0.0, 1.02))
        axes.xaxis.set_major_locator(MaxNLocator(_TICKS, steps=[1, 2, 5, 10]))
        axes.yaxis.set_major_formatter(PercentFormatter(1.0))
    if len(groups) > 1:
        legend_above(figure, panels[0])
    caption = (
        "Share that comes to at most so much, with a dot at the median of what comes. Left of 0 a region is violated."
    )
    yield NamedFigure("distributions", f"{caption} {addition}".rstrip(), figure)


def cumulative_fractions(values: Array) -> tuple[Array, Array]:
    """Return the empirical distribution of numbers; values (n,)."""
    finite = np.sort(values[np.isfinite(values)])
    return finite, np.arange(1, len(finite) + 1) / max(1, len(values))


def binned_rates(keys: Sequence[Key], facts: Mapping[str, Facts]) -> Figure:
    """Draw the rate of each fact in bins of each key, with 95 % intervals by Wilson; facts (n,)."""
    figure, panels = _panels(min(len(keys), _MAX_KEYS), 2.1)
    for axes, key in zip(panels, keys, strict=False):
        parts = list(bins(key.values))
        for fact, happened in facts.items():
            rates = [rate(happened[part.rows]) for part in parts]
            shares, low, high = (np.array([r[name] for r in rates]) for name in ("share", "low", "high"))
            axes.errorbar(
                [part.median for part in parts], shares, yerr=(shares - low, high - shares), label=fact,
                color=FACT_COLORS[fact], marker=_MARKS[fact], markersize=4, linewidth=1.0, elinewidth=1.6,
            )  # fmt: skip
        _format_key_axis(axes, key)
        axes.set(ylim=(-0.03, 1.03))
        axes.yaxis.set_major_formatter(PercentFormatter(1.0))
    legend_above(figure, panels[0])
    return figure


def scatter(keys: Sequence[Key], values: Array, label: str, reached: Facts, violated: Facts) -> Figure:
    """Draw a number of every row over each key, with markers by outcome; values (n,), reached, violated (n,)."""
    rows = np.flatnonzero(np.isfinite(values))
    if len(rows) > _POINTS:
        rows = rows[np.unique(np.linspace(0, len(rows) - 1, _POINTS).astype(int))]
    figure, panels = _panels(min(len(keys), _MAX_KEYS), 2.1)
    for axes, key in zip(panels, keys, strict=False):
        for what, of, color, mark in (
            ("reached, nothing violated", reached & ~violated, GREEN, "o"),
            ("not reached, nothing violated", ~reached & ~violated, ORANGE, "^"),
            ("violated", violated, RED, "x"),
        ):
            if (at := rows[of[rows]]).size:
                axes.plot(key.values[at], values[at], mark, color=color, markersize=3.5, alpha=0.7, label=what)
        axes.axhline(0.0, color=BLACK, linewidth=0.8)
        _format_key_axis(axes, key)
        axes.set(ylabel=label)
    legend_above(figure, panels[0])
    return figure


def side_by_side(one: str, results: Results, other: str, others: Results, columns: Sequence[tuple[str, str]]) -> Figure:
    """Draw each scene as a marker at the numbers of both laws, by which of them completes it."""
    sample = np.unique(np.linspace(0, len(results) - 1, min(len(results), _MAX_SCENES)).astype(int))
    mine, theirs = (rows["reached"] & ~rows["violation"] for rows in (results, others))
    figure = Figure(figsize=(WIDTH, 3.4), layout="constrained")
    panels = figure.subplots(1, len(columns), squeeze=False)[0]
    for axes, (name, label) in zip(panels, columns, strict=True):
        x, y = results.number(name), others.number(name)
        there = np.concatenate([x[np.isfinite(x)], y[np.isfinite(y)]])
        low, high = (min(0.0, float(there.min())), float(there.max())) if there.size else (0.0, 1.0)
        never = high + (_NEVER - 1.0) * (high - low)
        for values, line, at in ((x, axes.axvline, (never, low)), (y, axes.axhline, (low, never))):
            if not np.isfinite(values).all():
                line(never, color=BLACK, linewidth=0.6, linestyle=":")
                upright = {"rotation": 90, "ha": "right"} if line == axes.axvline else {}
                axes.annotate("never", at, (-2, 2), textcoords="offset points", fontsize=8, **upright)
        x, y = (np.where(np.isfinite(values), values, never) for values in (x, y))
        for what, mask, color, mark in (
            ("both complete", mine & theirs, GREEN, "o"),
            (f"only {one}", mine & ~theirs, BLUE, "<"),
            (f"only {other}", theirs & ~mine, ORANGE, "^"),
            ("neither", ~mine & ~theirs, RED, "x"),
        ):
            if not mask.any():
                continue
            rows = sample[mask[sample]]
            axes.plot(x[rows], y[rows], mark, color=color, markersize=3.5, alpha=0.7, label=f"{what} ({mask.sum()})")
        axes.plot([low, high], [low, high], color=BLACK, linewidth=0.8)
        axes.set(xlabel=f"{label}, {one}", ylabel=f"{label}, {other}")
    legend_above(figure, panels[0])
    return figure


def _panels(count: int, height: float) -> tuple[Figure, list[Axes]]:
    """Create a figure with `count` panels."""
    down = -(-count // _PANELS_PER_ROW)
    figure = Figure(figsize=(WIDTH, 0.35 + height * down), layout="constrained")
    axes = figure.subplots(down, min(count, _PANELS_PER_ROW), squeeze=False).ravel()
    for unused in axes[count:]:
        unused.set_visible(False)
    return figure, list(axes[:count])


def _format_key_axis(axes: Axes, key: Key) -> None:
    """Label the axis of a key: few ticks on a logarithmic scale, no fractions for whole numbers."""
    axes.set(xlabel=key.label, xscale="log" if key.log else "linear")
    if key.log:
        wide = key.values.max() > _WIDE * key.values.min()
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0,) if wide else (1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())
    else:
        whole = np.array_equal(key.values, np.round(key.values))
        axes.xaxis.set_major_locator(MaxNLocator(_TICKS, steps=[1, 2, 5, 10], integer=whole))


def legend_above(figure: Figure, axes: Axes) -> None:
    """Add the legend of a panel above a figure, in as many columns as fit."""
    handles, labels = axes.get_legend_handles_labels()
    columns = int(_LETTERS // (max(map(len, labels)) + _MARK) * WIDTH / 6.4)
    figure.legend(handles, labels, loc="outside upper center", ncols=max(1, min(columns, len(labels))))


def _thin(x: Array, shares: Array) -> tuple[Array, Array]:
    if len(x) <= _STEPS:
        return x, shares
    rows = np.unique(np.linspace(0, len(x) - 1, _STEPS).astype(int))
    return x[rows], shares[rows]
