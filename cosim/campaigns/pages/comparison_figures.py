"""Figures that compare two laws scene by scene."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from cosim.campaigns.pages.figures import WIDTH, legend_above
from cosim.campaigns.store.results import Results
from cosim.report.figures.style import BLACK, BLUE, GREEN, ORANGE, RED

_MAX_SCENES = 1500  # maximum number of scenes that are drawn
_NEVER = 1.12  # distance of missing numbers from the minimum number, as a multiple of the range of the numbers


def side_by_side(one: str, results: Results, other: str, others: Results, columns: Sequence[tuple[str, str]]) -> Figure:
    """Draw each scene as a marker at the numbers of both laws, by which of them completes it."""
    some = np.unique(np.linspace(0, len(results) - 1, min(len(results), _MAX_SCENES)).astype(int))
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
            at = some[mask[some]]
            axes.plot(x[at], y[at], mark, color=color, markersize=3.5, alpha=0.7, label=f"{what} ({mask.sum()})")
        axes.plot([low, high], [low, high], color=BLACK, linewidth=0.8)
        axes.set(xlabel=f"{label}, {one}", ylabel=f"{label}, {other}")
    legend_above(figure, panels[0])
    return figure
