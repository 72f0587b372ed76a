"""Plots of a run's signals over time, one pair of axes for each unit."""

from __future__ import annotations

import fnmatch
import textwrap
from collections.abc import Sequence
from typing import Any

from cosim.errors import RunError
from cosim.results.record import Record
from plant_fmu.toml_tables import hint

_CHARACTER = 0.55  # width of a character of a title, as a fraction of its font size
_POINTS = 72.0  # points of an inch
_HEIGHT = 2.4  # inches that each further unit adds


def plot_signals(record: Record, patterns: Sequence[str], title: str, ax: Any) -> Any:
    """Draw signals, by names or patterns, in axes for each unit or in `ax`; return the first. May raise RunError."""
    import matplotlib.pyplot as plt

    units = record.units
    by_unit: dict[str, dict[str, None]] = {}
    for pattern in patterns:
        names = fnmatch.filter(units, pattern)
        if not names:
            raise RunError(f"signal {pattern!r} is unknown; {hint(pattern, list(units))}")
        for name in names:
            by_unit.setdefault(units[name], {})[name] = None
    if ax is None:
        width, height = plt.rcParams["figure.figsize"]
        size = (width, height + _HEIGHT * (len(by_unit) - 1))
        column = list(
            plt.subplots(len(by_unit), sharex=True, squeeze=False, figsize=size, layout="constrained")[1][:, 0]
        )
    elif len(by_unit) == 1:
        column = [ax]
    else:
        units_of_signals = " and ".join(unit or "no unit" for unit in by_unit)
        raise RunError(f"ax is given for signals in {units_of_signals}, expected one unit, or no ax")
    for axes, (unit, names_of_unit) in zip(column, by_unit.items(), strict=True):
        for name in names_of_unit:
            axes.plot(record["time"], record[name], label=name)
        axes.set_ylabel(f"[{unit}]" if unit else "")
        axes.legend()
    column[-1].set_xlabel("time [s]")
    first = column[0]
    first.set_title(_wrap_title(title, first), fontsize="medium")
    return first


def _wrap_title(title: str, axes: Any) -> str:
    """Break a title into lines that are no wider than the axes, which are as wide as their figure at most."""
    width = axes.get_window_extent().width / axes.figure.dpi * _POINTS
    size = axes.title.get_fontproperties().get_size_in_points()
    unbroken = title.replace(" = ", "\u00a0=\u00a0")
    return textwrap.fill(unbroken, max(10, int(width / (_CHARACTER * size))))
