"""Time axes with a break where the vehicle has come to rest, so that its motion before has most of the width."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, MaxNLocator

from cosim.report.figures.style import BLACK
from cosim.results.record import Rows
from cosim.simulation.signals import Array

# the vehicle rests within these distances of its final pose
_NEAR = 0.02  # distance, as a fraction of the path's extent
_TURNED = 0.05  # difference of an element of the quaternion
_MARGIN = 1.05  # time of the break, relative to the time from which the vehicle rests
_LATEST = 2.0 / 3.0  # latest time of the break, as a fraction of the run
_TAIL = 0.15  # fraction of the axis that shows the time at rest


def rests_from(record: Rows) -> float | None:
    """Return the time from which the vehicle stays at its final pose [s]."""
    time = record["time"]
    positions = record.stack([f"position.{axis}" for axis in "xyz"])
    turns = record.stack([f"quaternion.e{i}" for i in range(4)])
    if len(time) < 2 or not (np.isfinite(positions).all() and np.isfinite(turns).all()):
        return None
    extent = float(np.linalg.norm(np.ptp(positions, axis=0)))
    moves = (np.abs(positions - positions[-1]) > _NEAR * extent).any(axis=1) | (
        np.abs(turns - turns[-1]) > _TURNED
    ).any(axis=1)
    rows = np.flatnonzero(moves)
    if not rows.size or rows[-1] + 1 == len(time):
        return None
    start, end = float(time[0]), float(time[-1])
    rest = start + _MARGIN * (float(time[rows[-1] + 1]) - start)
    return rest if start < rest < start + _LATEST * (end - start) else None


def break_time(axes: Sequence[Axes], rest_start: float, end: float) -> None:
    """Shorten the time from `rest_start` to `end` [s], on gray, in axes of a whole run that share their time."""
    slope = _TAIL / (1.0 - _TAIL) * rest_start / (end - rest_start)

    def forward(t: Array) -> Array:
        return np.where(t > rest_start, rest_start + slope * (t - rest_start), t)

    def inverse(x: Array) -> Array:
        return np.where(x > rest_start, rest_start + (x - rest_start) / slope, x)

    ticks = [
        t for t in MaxNLocator(6, steps=[1, 2, 5, 10]).tick_values(0.0, rest_start) if 0.0 <= t <= 0.97 * rest_start
    ]
    for ax in axes:
        ax.set_xscale("function", functions=(forward, inverse))
        ax.set_xlim(0.0, end)
        ax.xaxis.set_major_locator(FixedLocator([*ticks, end]))
        ax.axvspan(rest_start, end, color=BLACK, alpha=0.06, linewidth=0)
    middle = inverse(np.array(rest_start + 0.5 * slope * (end - rest_start)))
    axes[0].text(
        float(middle), 0.98, "at rest", transform=axes[0].get_xaxis_transform(), ha="center", va="top", fontsize=7
    )
