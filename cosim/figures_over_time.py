"""What the vehicle did and why: errors, weights, clearances, forces and estimates over time."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from controller.regions import Sphere, of_attitude
from cosim.drawing import (
    BLACK,
    BLUE,
    CRITERION_COLOURS,
    CYCLE,
    GOAL_COLOUR,
    ORANGE,
    RED,
    Story,
    labels_of,
    legend_columns,
    regions_of,
    shifts_of,
    thin,
)
from cosim.helm.orders import MODES
from cosim.scenario import CRITERIA, Scenario
from cosim.signals import Array
from cosim.summary import spans

_AWAY = 1e4  # m; regions further off have not come yet


def _axes(height: float = 2.6, rows: int = 1) -> tuple[Figure, Any]:
    figure = Figure(figsize=(6.8, height), layout="constrained")
    axes = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
    axes[-1].set_xlabel("time [s]")
    return figure, axes


def _zoomed(story: Story, height: float, rows: int = 1) -> tuple[Figure, Any]:
    """Return axes for the whole run, shape (rows, 1), or (rows, 2) with the time of the overlap on the left."""
    windows = story.summary["intersection_windows"]
    until = 1.6 * windows[0][1] if windows else np.inf
    if until > 0.4 * story.summary["simulated_time"]:
        figure, axes = _axes(height, rows)
        return figure, axes[:, None]
    figure = Figure(figsize=(6.8, height), layout="constrained")
    axes = figure.subplots(rows, 2, sharex="col", sharey="row", squeeze=False, width_ratios=[2, 3])
    for ax in axes[:, 0]:
        ax.set_xlim(0.0, until)
        ax.axvspan(*windows[0], color=BLACK, alpha=0.08)
    for ax in axes[-1]:
        ax.set_xlabel("time [s]")
    return figure, axes


def _curves(axes: Any, story: Story, signals: dict[str, Array], **style: Any) -> None:
    """Draw signals into one axes, or into several that show different spans of time."""
    for ax in np.atleast_1d(axes):
        seen = story.record["time"] <= (ax.get_xlim()[1] if not ax.get_autoscalex_on() else np.inf)
        time, *thinned = thin(story.record["time"][seen], *(signal[seen] for signal in signals.values()))
        for label, signal in zip(signals, thinned, strict=True):
            ax.plot(time, signal, label=label, **style)


def _legend(figure: Figure, ax: Axes, ncols: int) -> None:
    figure.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=ncols)


def _symlog(ax: Axes, largest: float, linear: float) -> None:
    """Make an axis linear to about `linear` and logarithmic beyond."""
    threshold = 10.0 ** np.ceil(np.log10(max(linear, 1.0)))
    decades = 10.0 ** np.arange(np.log10(threshold), np.ceil(np.log10(largest)) + 1.0)
    ax.set_yscale("symlog", linthresh=threshold)
    ax.set_yticks([*-decades[::-1], 0.0, *decades])
    ax.set_ylim(-1.5 * largest, 1.5 * largest)


def position_error(story: Story) -> Figure:
    """Draw the RMS error to the goal's centre, or the distance to the goal where it has none."""
    figure, (ax,) = _axes()
    bounds = np.array(story.scenario.goal.bounds())
    if np.isfinite(bounds).all():
        centre = bounds.mean(axis=0) + shifts_of(story, "goal")
        error = np.linalg.norm(story.record.stack([f"position.{a}" for a in "xyz"]) - centre, axis=1)
        _curves(ax, story, {"RMS error": error / np.sqrt(3.0)})
        ax.set_ylabel("RMS error [m]")
    else:
        _curves(ax, story, {"distance to the goal": np.maximum(0.0, -story.record["goal.clearance"])})
        ax.set_ylabel("distance [m]")
    if isinstance(story.scenario.goal, Sphere):
        tolerance = story.scenario.goal.radius / np.sqrt(3.0)
        ax.axhline(tolerance, color=GOAL_COLOUR, linestyle="--", label="tolerance r_v/√3")
    ax.set_ylim(bottom=0.0)
    ax.legend()
    return figure


def attitude(story: Story) -> Figure:
    """Draw roll, pitch and yaw."""
    figure, (ax,) = _axes()
    _curves(ax, story, {name: np.rad2deg(story.record[f"attitude.{name}"]) for name in ("roll", "pitch", "yaw")})
    ax.set_ylabel("Euler angle [°]")
    ax.legend(ncols=3)
    return figure


def weights_overlap(story: Story) -> Figure:
    """Draw the weights around each window in which the regions overlap, at most the first three."""
    windows = story.summary["intersection_windows"][:3]
    figure = Figure(figsize=(6.8, 2.8), layout="constrained")
    axes = figure.subplots(1, len(windows), sharey=True, squeeze=False)[0]
    time = story.record["time"]
    for ax, (start, end) in zip(axes, windows, strict=True):
        room = max(0.5 * (end - start), 5 * story.scenario.time.step)
        shown = (time >= start - room) & (time <= end + room)
        for i, name in enumerate(CRITERIA):
            weight = story.record[f"weight.{name}"][shown]
            ax.plot(time[shown], weight, color=CRITERION_COLOURS[name], label=f"α{i + 1} {name}")
        ax.axvspan(start, end, color=BLACK, alpha=0.08, label="overlap")
        ax.set_title(f"{start:.3f} s to {end:.3f} s", fontsize=9)
        ax.set_xlabel("time [s]")
    axes[0].set_ylabel("normalised weight [–]")
    axes[0].set_ylim(-0.05, 1.05)
    _legend(figure, axes[0], 4)
    return figure


def weights(story: Story) -> Figure:
    """Draw memberships and weights of each criterion."""
    figure, axes = _zoomed(story, 4.2, len(CRITERIA))
    for i, (row, name) in enumerate(zip(axes, CRITERIA, strict=True)):
        _curves(row, story, {"weight": story.record[f"weight.{name}"]}, color=CRITERION_COLOURS[name])
        _curves(row, story, {"membership": story.record[f"membership.{name}"]}, color=BLACK, linestyle=":")
        row[0].set(ylabel=f"α{i + 1} {name}", ylim=(-0.05, 1.05))
    _legend(figure, axes[0, 0], 2)
    return figure


def clearance(story: Story) -> Figure:
    """Draw the clearance to each region and to the goal: distances, and angles below them where there are any."""
    regions = list(enumerate(regions_of(story.scenario)))
    groups = [[(i, of) for i, of in regions if of_attitude(of[0].shape) == angle] for angle in (False, True)]
    figure, axes = _zoomed(story, 3.0 if not groups[1] else 4.6, 1 if not groups[1] else 2)
    styles = ("-", "--", "-.", ":")
    labels = labels_of([of for _, of in regions])
    for row, group, unit in zip(axes, groups, ("m", "°"), strict=False):
        for i, (region, colour) in group:
            label = labels.get(region.name, "_")  # which legends leave out
            signal = story.record[f"{region.name}.clearance"]
            signal = np.rad2deg(signal) if unit == "°" else np.where(signal < _AWAY, signal, np.nan)
            _curves(row, story, {label: signal}, color=colour, linestyle=styles[i % 4])
        for ax in row:
            ax.set_ylim(ax.get_ylim())
            ax.axhspan(ax.get_ylim()[0], 0.0, color=RED, alpha=0.06, linewidth=0)
            ax.axhline(0.0, color=BLACK, linewidth=0.8)
        row[0].set_ylabel(f"clearance [{unit}]")
    drawn = [dict(zip(*reversed(row[0].get_legend_handles_labels()), strict=True)) for row in axes]
    handles = {label: handle for of_row in drawn for label, handle in of_row.items()}
    figure.legend(handles.values(), handles.keys(), loc="outside upper center", ncols=legend_columns(handles))
    return figure


def helm(story: Story) -> Figure:
    """Draw who steers, and whether the thrusters may work."""
    figure, (ax,) = _axes(2.0)
    time, mode = story.record["time"], story.record["helm.mode"]
    armed = story.record["helm.armed"] > 0.0
    changes = [0, *(np.flatnonzero(np.diff(mode) != 0.0) + 1).tolist(), len(time) - 1]
    for first, last in zip(changes, changes[1:], strict=False):
        row = int(mode[first])
        ax.broken_barh([(time[first], time[last] - time[first])], (row - 0.4, 0.8), color=CYCLE[row])
    for start, end in spans(~armed, time):
        ax.axvspan(start, end, color=BLACK, alpha=0.2, linewidth=0)
    ax.set(yticks=range(len(MODES)), yticklabels=MODES, ylim=(len(MODES) - 0.4, -0.6))
    if time[-1] > 0.0:
        ax.set_xlim(0.0, float(time[-1]))
    return figure


def forces(story: Story) -> Figure:
    """Draw the norm of the body force on a logarithmic axis, and its components."""
    figure, (norm, parts) = _axes(4.6, 2)
    asked = np.linalg.norm(story.record.stack([f"command.{a}" for a in "XYZ"]), axis=1)
    acting = np.linalg.norm(story.record.stack([f"actuation.{a}" for a in "XYZ"]), axis=1)
    floor = 1e-2
    _curves(norm, story, {"acting": np.maximum(acting, floor)}, color=BLUE)
    _curves(norm, story, {"asked for": np.maximum(asked, floor)}, color=RED, linestyle="--")
    norm.set(yscale="log", ylabel="‖F‖ [N]")
    norm.legend(ncols=2)
    _curves(parts, story, {f"{a} acting": story.record[f"actuation.{a}"] for a in "XYZ"})
    largest, typical = float(acting.max()), float(np.percentile(acting, 90))
    if largest > 20.0 * max(typical, 1.0):  # a spike would flatten all the rest
        _symlog(parts, largest, typical)
    parts.set_ylabel("force [N]")
    parts.legend(ncols=3)
    return figure


def thruster_caption(scenario: Scenario) -> str:
    """Return what the thruster figure shows."""
    if scenario.actuation.through == "thrusters":
        return "Force of each thruster, and its limits (dashed)."
    return (
        "What the acting body wrench would ask of each thruster (pseudo-inverse), and what a thruster gives (dashed): "
        "in this scenario the wrench acts on the body directly, not through the thrusters."
    )


def thrusters(story: Story) -> Figure:
    """Draw the force of each thruster, or what it would have to give."""
    vehicle = story.scenario.vehicle
    if story.scenario.actuation.through == "thrusters":
        force = story.record.stack([f"thruster_force[{i + 1}]" for i in range(vehicle.n_thrusters)])
    else:
        wrench = story.record.stack([f"actuation.{a}" for a in "XYZKMN"])
        force = wrench @ np.linalg.pinv(vehicle.thruster_matrix).T
    figure, (ax,) = _axes(3.0)
    for i in range(vehicle.n_thrusters):
        style = "-" if i < len(CYCLE) // 2 else "--"
        _curves(ax, story, {str(i + 1): force[:, i]}, color=CYCLE[i % len(CYCLE)], linestyle=style, linewidth=1.0)
    lowest, highest = float(vehicle.thrust_min.min()), float(vehicle.thrust_max.max())
    for bound in (lowest, highest):
        ax.axhline(bound, color=BLACK, linestyle="--", linewidth=0.8)
    if np.abs(force).max() > 5.0 * max(highest, -lowest):
        _symlog(ax, float(np.abs(force).max()), max(highest, -lowest))
    ax.set_ylabel("thrust [N]")
    _legend(figure, ax, 8)
    return figure


def estimates(story: Story) -> Figure:
    """Draw the estimates against the truth."""
    figure, (force, moment) = _axes(4.2, 2)
    truth = story.scenario.true_restoring_parameters
    labels = ("W − B", "x_G W − x_B B", "y_G W − y_B B", "z_G W − z_B B")
    styles = ("-", "-", "--", "-")
    for i, label in enumerate(labels):
        ax, colour = (force, BLUE) if i == 0 else (moment, CYCLE[i])
        _curves(ax, story, {label: story.record[f"estimate.phi{i + 1}"]}, color=colour, linestyle=styles[i])
        ax.axhline(truth[i], color=colour, linestyle=":", linewidth=1.0)
    force.set_ylabel("φ̂1 [N]")
    moment.set_ylabel("φ̂2 … φ̂4 [N m]")
    force.legend()
    moment.legend(ncols=3)
    return figure


def lyapunov(story: Story) -> Figure:
    """Draw V in its three forms, and its rate."""
    figure, axes = _zoomed(story, 4.6, 2)
    forms = {form: story.record[f"lyapunov.{form}"] for form in ("printed", "normalised", "primary")}
    labels = ("V as printed", "V, potential of the force", "V, primary region alone")
    for label, V, colour, style in zip(labels, forms.values(), (ORANGE, BLUE, BLACK), ("-", "--", ":"), strict=True):
        _curves(axes[0], story, {label: V}, color=colour, linestyle=style)
    rate = story.record["lyapunov.rate"]
    _curves(axes[1], story, {"dV/dt = −W": rate}, color=BLUE)
    for row, signal, bad in ((axes[0], forms["normalised"], -1.0), (axes[1], rate, 1.0)):
        largest, typical = float(np.abs(signal).max()), float(np.percentile(np.abs(signal), 50))
        for ax in row:
            if largest > 20.0 * max(typical, 1.0):  # the beginning would flatten all the rest
                _symlog(ax, largest, max(typical, 1e-3 * largest))
            else:
                ax.set_ylim(1.1 * min(0.0, float(signal.min())) - 0.05 * largest, 1.1 * largest)
            limits = ax.get_ylim()
            ax.axhspan(0.0, limits[0] if bad < 0.0 else limits[1], color=RED, alpha=0.06, linewidth=0)
            ax.set_ylim(limits)
            ax.axhline(0.0, color=BLACK, linewidth=0.8)
    axes[0, 0].set_ylabel("V [N m]")
    axes[1, 0].set_ylabel("dV/dt = −W [W]")
    _legend(figure, axes[0, 0], 3)
    return figure
