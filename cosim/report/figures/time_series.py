"""Figures over time: errors, attitude, velocities, weights, clearances, control modes, and V."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from controller.regions import Sphere
from controller.regions.region_set import of_attitude
from cosim.report.figures.broken_time import break_time, rests_from
from cosim.report.figures.layout import legend, limits_of, panels, symlog_axis
from cosim.report.figures.style import (
    BLACK,
    BLUE,
    CYCLE,
    GREEN,
    ORANGE,
    RED,
    FigureData,
    regions_of,
    shifts_of,
    thin,
)
from cosim.results.record import Rows
from cosim.results.spans import spans
from cosim.scenario.colors import GOAL_COLOR
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands.commands import MODES
from cosim.simulation.signals import Array

_AWAY = 1e4  # m; regions further away are free obstacle slots
_NAMED = 8  # maximum number of regions that a legend names one by one
_NEAREST = 5  # regions named beside the goal if there are more
DASHES = ("-", "--", "-.", ":")
_WINDOWS = 3  # maximum number of windows that are shown
_WIDER = 1.6  # end of the enlarged span, relative to the end of the first overlap
_TIME = "time [s]"


def zooms(data: FigureData) -> bool:
    """Return True if the first overlap is so early that figures over the whole run would not show it."""
    windows = data.summary["intersection_windows"]
    return bool(windows) and 0.0 < _WIDER * windows[0][1] <= 0.4 * data.summary["simulated_time"]


def enlarged(data: FigureData) -> list[tuple[float, float]]:
    """Return the spans of time [s] that figures show enlarged, besides the whole run."""
    windows = data.summary["intersection_windows"]
    spans = [_around(data, start, end) for start, end in windows[:_WINDOWS]]
    return [*spans, (0.0, _WIDER * windows[0][1])] if zooms(data) else spans


def _around(data: FigureData, start: float, end: float) -> tuple[float, float]:
    """Return the span [s] that is shown around a window of overlap."""
    room = max(0.5 * (end - start), 5 * data.scenario.time.step)
    return start - room, end + room


def _zoomed(data: FigureData, heights: Sequence[float], labels: Sequence[str]) -> tuple[Figure, Any]:
    """Create axes for the whole run, shape (rows, 1), or (rows, 2) with the time of the overlap on the left."""
    if not zooms(data):
        figure, axes = over_time(data, heights, labels)
        return figure, axes[:, None]
    figure, axes = panels(heights, (2.0, 3.0), labels)
    start, end = data.summary["intersection_windows"][0]
    for ax in axes[:, 0]:
        ax.axvspan(start, end, color=BLACK, alpha=0.08, linewidth=0)
    axes[0, 0].set_xlim(0.0, _WIDER * end)
    axes[0, 0].xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    axes[0, 1].set_xlim(0.0, data.summary["simulated_time"])
    for ax in axes[-1]:
        ax.set_xlabel(_TIME)
    return figure, axes


def over_time(data: FigureData, heights: Sequence[float], labels: Sequence[str]) -> tuple[Figure, Any]:
    """Create axes over the whole run, shape (rows,); a break in time shortens an early rest."""
    figure, axes = panels(heights, labels=labels)
    end = data.summary["simulated_time"]
    axes[0, 0].set_xlim(0.0, end or data.scenario.time.step)
    rest = rests_from(data.record)
    if rest is not None:
        break_time(axes[:, 0], rest, end)
    axes[-1, 0].set_xlabel(_TIME)
    return figure, axes[:, 0]


def curve(axes: Any, data: FigureData, signal: Array, **style: Any) -> Line2D:
    """Draw a signal into one axes, or into several with different spans of time; return one of its lines."""
    time = data.record["time"]
    marker = "o" if len(time) == 1 else ""
    for ax in np.atleast_1d(axes):
        seen = slice(0, int(np.searchsorted(time, ax.get_xlim()[1], side="right")) + 1)
        lines: list[Line2D] = ax.plot(*thin(time[seen], signal[seen]), marker=marker, markersize=4, **style)
    return lines[0]


def _zero_line(ax: Axes) -> None:
    ax.axhline(0.0, color=BLACK, linewidth=0.8)


def error_of(scenario: Scenario, record: Rows) -> tuple[str, Array]:
    """Return name and values of the RMS error to the goal's center, or of the distance to a goal without one."""
    # with returns [m]
    bounds = np.array(scenario.goal.bounds())
    if not np.isfinite(bounds).all():
        return "distance to the goal", np.maximum(0.0, -record["goal.clearance"])
    center = bounds.mean(axis=0) + shifts_of(record, "goal")
    path = record.stack([f"position.{a}" for a in "xyz"])
    return "RMS error", np.linalg.norm(path - center, axis=1) / np.sqrt(3.0)


def position_error(data: FigureData) -> Figure:
    """Draw the RMS error to the goal's center, or the distance to a goal without one."""
    what, error = error_of(data.scenario, data.record)
    sphere = data.scenario.goal if isinstance(data.scenario.goal, Sphere) else None
    labels = [what, "tolerance r_v/√3"] if sphere else [what]
    figure, (ax,) = over_time(data, [2.0], labels)
    lines = [curve(ax, data, error)]
    ax.set_ylabel(f"{what} [m]")
    if sphere:
        lines.append(ax.axhline(sphere.radius / np.sqrt(3.0), color=GOAL_COLOR, linestyle="--"))
    ax.set_ylim(0.0, limits_of([error, np.array([sphere.radius if sphere else 0.0])])[1])
    legend(figure, dict(zip(labels, lines, strict=True)))
    return figure


def attitude(data: FigureData) -> Figure:
    """Draw roll, pitch and yaw."""
    angles = {name: np.rad2deg(data.record[f"attitude.{name}"]) for name in ("roll", "pitch", "yaw")}
    figure, (ax,) = over_time(data, [2.0], list(angles))
    styles = zip(angles.items(), (BLUE, RED, GREEN), DASHES, strict=False)
    legend(figure, {n: curve(ax, data, angle, color=c, linestyle=s) for (n, angle), c, s in styles})
    ax.set_ylim(*limits_of(list(angles.values()), least=2.0))
    ax.set_ylabel("Euler angles, NED to body [°]", fontsize=8)
    return figure


def velocities(data: FigureData) -> Figure:
    """Draw linear and angular velocity."""
    groups = (("uvw", "velocity [m/s]", 0.1), ("pqr", "angular velocity [rad/s]", 0.05))
    figure, axes = over_time(data, [1.7, 1.7], list("uvwpqr"))
    entries: dict[str, Artist] = {}
    for ax, (names, label, least) in zip(axes, groups, strict=True):
        signals = {name: data.record[f"velocity.{name}"] for name in names}
        for (name, signal), color, dashes in zip(signals.items(), (BLUE, RED, GREEN), DASHES, strict=False):
            entries[name] = curve(ax, data, signal, color=color, linestyle=dashes)
        ax.set_ylim(*limits_of(list(signals.values()), least=least))
        ax.set_ylabel(label)
    legend(figure, entries)
    return figure


def weights_overlap(data: FigureData) -> Figure:
    """Draw the weights around each window in which the regions overlap, at most the first three."""
    windows = data.summary["intersection_windows"][:_WINDOWS]
    criteria = data.scenario.criteria
    labels = [f"α{i + 1} {criterion.name}" for i, criterion in enumerate(criteria)]
    figure, axes = panels([2.0], [1.0] * len(windows), [*labels, "overlap"], titles=0.2)
    time = data.record["time"]
    for ax, (start, end) in zip(axes[0], windows, strict=True):
        first, last = _around(data, start, end)
        shown = (time >= first) & (time <= last)
        entries: dict[str, Artist] = {}
        for label, criterion, dashes in zip(labels, criteria, cycle(DASHES), strict=False):
            curve = thin(time[shown], data.record[f"weight.{criterion.name}"][shown])
            (entries[label],) = ax.plot(*curve, color=criterion.color, linestyle=dashes)
        entries["overlap"] = ax.axvspan(start, end, color=BLACK, alpha=0.08, linewidth=0)
        ax.set_title(f"{start:.3f} s to {end:.3f} s", fontsize=8, pad=3)
        ax.set_xlim(float(time[shown][0]), float(time[shown][-1]) + 1e-9)
        ax.xaxis.set_major_locator(MaxNLocator(8 // len(windows), steps=[1, 2, 5, 10]))
        ax.set_xlabel(_TIME)
    axes[0, 0].set_ylabel("normalized weight [–]")
    axes[0, 0].set_ylim(-0.05, 1.05)
    legend(figure, entries)
    return figure


def weights(data: FigureData) -> Figure:
    """Draw memberships and weights of each criterion."""
    labels = ["weight, in its criterion's color", "membership"]
    criteria = data.scenario.criteria
    figure, axes = _zoomed(data, [0.95] * len(criteria), labels)
    for i, (row, criterion) in enumerate(zip(axes, criteria, strict=True)):
        name = criterion.name
        lines = [
            curve(row, data, data.record[f"weight.{name}"], color=criterion.color, linewidth=1.8),
            curve(row, data, data.record[f"membership.{name}"], color=BLACK, linestyle=":", linewidth=1.0),
        ]
        row[0].set(ylim=(-0.06, 1.06), yticks=(0.0, 0.5, 1.0))
        row[0].set_ylabel(f"α{i + 1} {name} [–]", fontsize=7.5)
    legend(figure, dict(zip(labels, lines, strict=True)))
    return figure


def clearance(data: FigureData) -> Figure:
    """Draw the clearance to each region and to the goal: distances, and angles of attitude regions below."""
    regions = list(regions_of(data.scenario))
    of_places = [entry for entry in regions if not of_attitude(entry[0].shape)]
    of_angles = [entry for entry in regions if of_attitude(entry[0].shape)]
    named = _named(data, [region.name for region, _ in regions])
    others = len(regions) - len(named)
    labels = [region.name for region, _ in (*of_places, *of_angles) if region.name in named]
    other_labels = [f"{others} others"] if others else []
    figure, axes = _zoomed(data, [2.5, 1.5] if of_angles else [2.5], [*labels, *other_labels])
    entries: dict[str, Artist] = {}
    command = [region.name for region, _ in regions if region.name in named]
    for row, group, unit in zip(axes, (of_places, of_angles), ("m", "°"), strict=False):
        signals = []
        for region, color in sorted(group, key=lambda entry: entry[0].name in named):  # the others behind
            signal = data.record[f"{region.name}.clearance"]
            signal = np.rad2deg(signal) if unit == "°" else np.where(np.abs(signal) < _AWAY, signal, np.nan)
            signals.append(signal)
            if region.name in named:
                i = command.index(region.name)
                dashes, width = DASHES[i % len(DASHES)], 1.3 if i < len(DASHES) else 0.8
                entries[region.name] = curve(row, data, signal, color=color, linestyle=dashes, linewidth=width)
            else:
                entries[other_labels[0]] = curve(row, data, signal, color=color, alpha=0.3, linewidth=0.6)
        low, high = limits_of(signals)
        low = min(low, -0.08 * (high - min(low, 0.0)))  # always shows some of the range below 0
        row[0].set_ylim(low, max(high, -0.2 * low))
        for ax in row:
            ax.axhspan(low, 0.0, color=RED, alpha=0.06, linewidth=0)
            _zero_line(ax)
        row[0].set_ylabel(f"clearance [{unit}]")
    legend(figure, {label: entries[label] for label in (*labels, *other_labels)})
    return figure


def _named(data: FigureData, names: list[str]) -> set[str]:
    """Return the names for the legend: all, or of many regions the goal and the nearest ones."""
    if len(names) <= _NAMED:
        return set(names)
    least = data.summary["min_clearance"]
    return {names[0], *sorted(names[1:], key=lambda name: np.nan_to_num(least[name], nan=np.inf))[:_NEAREST]}


def control_mode(data: FigureData) -> Figure:
    """Draw the control mode, and the times at which the vehicle is disarmed."""
    figure, (ax,) = over_time(data, [1.3], [])
    time, mode = data.record["time"], data.record["commands.mode"]
    armed = data.record["commands.armed"] > 0.0
    changes = [0, *(np.flatnonzero(np.diff(mode) != 0.0) + 1).tolist(), len(time) - 1]
    for first, last in zip(changes, changes[1:], strict=False):
        if np.isfinite(mode[first]):
            row = int(mode[first])
            ax.broken_barh([(time[first], time[last] - time[first])], (row - 0.4, 0.8), color=CYCLE[row])
    for start, end in spans(~armed, time):
        ax.axvspan(start, end, color=BLACK, alpha=0.2, linewidth=0)
    ax.set(ylim=(len(MODES) - 0.4, -0.6), ylabel="mode [–]")
    ax.set_yticks(range(len(MODES)), labels=MODES)
    return figure


def lyapunov(data: FigureData) -> Figure:
    """Draw V in its three forms, and its rate."""
    forms = {form: data.record[f"lyapunov.{form}"] for form in ("printed", "normalized", "primary")}
    labels = ("V as printed", "V, potential of the force", "V, primary region alone")
    figure, axes = _zoomed(data, [1.8, 1.8], labels)
    styles = zip(forms.values(), (ORANGE, BLUE, BLACK), DASHES, strict=False)
    lines = [curve(axes[0], data, V, color=color, linestyle=style) for V, color, style in styles]
    rate = data.record["lyapunov.rate"]
    curve(axes[1], data, rate, color=BLUE)
    for row, signal, bad_sign in ((axes[0], forms["normalized"], -1.0), (axes[1], rate, 1.0)):
        size = np.abs(signal[np.isfinite(signal)])
        largest, typical = (float(size.max()), float(np.percentile(size, 50))) if size.size else (0.0, 0.0)
        if largest > 20.0 * max(typical, 1.0):  # on a linear axis the beginning would hide the rest
            symlog_axis(row[0], largest, max(typical, 1e-3 * largest))
        else:
            row[0].set_ylim(*limits_of([signal, np.zeros(1)]))
        limits = row[0].get_ylim()
        for ax in row:
            ax.axhspan(0.0, limits[0] if bad_sign < 0.0 else limits[1], color=RED, alpha=0.06, linewidth=0)
            _zero_line(ax)
        row[0].set_ylim(limits)
    axes[0, 0].set_ylabel("V [N m]")
    axes[1, 0].set_ylabel("dV/dt = −W [W]")
    legend(figure, dict(zip(labels, lines, strict=True)))
    return figure
