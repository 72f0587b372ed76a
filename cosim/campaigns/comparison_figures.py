"""Figures of a comparison: how each measure is distributed over the scenes, law beside law."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from cosim.campaigns.results import Results
from cosim.drawing import BLACK, STYLE, Drawing
from cosim.signals import Array

# name, column, label, caption, whether only what was reached counts
_FIGURES = (
    ("reach-time", "reach_time", "reach time [s]", "Share of all scenes reached by a time.", False),
    ("effort", "effort", "effort [N s]", "Effort, over the scenes that each law reached.", True),
    (
        "min-clearance",
        "min_clearance",
        "least clearance [m]",
        "Least clearance; left of 0 a region is violated.",
        False,
    ),
)


def comparison_drawings(results: Mapping[str, Results]) -> Iterator[Drawing]:
    """Yield the figures of a comparison.

    Parameters
    ----------
    results : mapping from str to Results
        By law.

    Yields
    ------
    Drawing
        A cumulative distribution over the scenes for each law.
    """
    for name, column, label, caption, reached_only in _FIGURES:
        with mpl.rc_context(STYLE):
            figure = Figure(figsize=(6.4, 3.6), layout="constrained")
            axes = figure.add_subplot()
            for law, rows in results.items():
                kept = rows["reached"] if reached_only else np.ones(len(rows), dtype=bool)
                values, shares = shares_up_to(rows.number(column)[kept])
                axes.step(values, shares, where="post", label=law)
            if column == "min_clearance":
                axes.axvline(0.0, color=BLACK, linewidth=0.8)
            axes.set(xlabel=label, ylabel="share of scenes", ylim=(0.0, 1.02))
            axes.legend()
            yield Drawing(name, caption, figure)


def shares_up_to(values: Array) -> tuple[Array, Array]:
    """Return the empirical distribution of numbers.

    Parameters
    ----------
    values : ndarray, shape (n,)
        NaN where there is none: such are counted, and never come.

    Returns
    -------
    ndarray, ndarray
        The finite ones in rising order, and the share of all that is at most each.
    """
    finite = np.sort(values[np.isfinite(values)])
    return finite, np.arange(1, len(finite) + 1) / max(1, len(values))
