"""The figures over time of a run: errors, motion, weights, clearances, forces, estimates, and V."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle

import numpy as np
from matplotlib.figure import Figure

from controller.regions import Sphere
from controller.regions.region_set import of_attitude
from cosim.report.figures.layout import limits_of, log_axis
from cosim.report.figures.panels import DASHES, Line, Panel, draw_panels, fit, fit_spikes, percentile
from cosim.report.figures.style import BLACK, BLUE, CYCLE, GREEN, ORANGE, RED, FigureData, regions_of, shifts_of
from cosim.results.record import Rows
from cosim.results.region_colors import GOAL_COLOR
from cosim.results.spans import spans
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands.commands import MODES
from cosim.simulation.signals import Array

_AWAY = 1e4  # m; regions further away are free obstacle slots
_NAMED = 8  # maximum number of regions that a legend names one by one
_NEAREST = 5  # regions named beside the goal if there are more
_FLOOR = 1e-2  # N, minimum value on a logarithmic axis
_ESTIMATES = ("W − B", "x_G W − x_B B", "y_G W − y_B B", "z_G W − z_B B")


def _lines(labels: Sequence[str], signals: Sequence[Array], colors: Sequence[str] = (BLUE, RED, GREEN)) -> list[Line]:
    """Return lines of different colors and dashes."""
    styles = [{"color": color, "linestyle": dashes} for color, dashes in zip(colors, cycle(DASHES), strict=False)]
    return [Line(*line) for line in zip(labels, signals, styles, strict=True)]


def error_of(scenario: Scenario, record: Rows) -> tuple[str, Array]:
    """Return name and values [m] of the RMS error to the goal's center, or of the distance to a goal without one."""
    bounds = np.array(scenario.goal.bounds())
    if not np.isfinite(bounds).all():
        return "distance to the goal", np.maximum(0.0, -record["goal.clearance"])
    center = bounds.mean(axis=0) + shifts_of(record, "goal")
    path = record.stack([f"position.{a}" for a in "xyz"])
    return "RMS error", np.linalg.norm(path - center, axis=1) / np.sqrt(3.0)


def position_error(data: FigureData) -> list[Panel]:
    """Show the RMS error to the goal's center, or the distance to a goal without one."""
    what, error = error_of(data.scenario, data.record)
    lines, radius = [Line(what, error, {})], 0.0
    if isinstance(data.scenario.goal, Sphere):
        radius = data.scenario.goal.radius
        lines.append(Line("tolerance r_v/√3", radius / 3.0**0.5, {"color": GOAL_COLOR, "linestyle": "--"}))
    top = limits_of([error, np.array([radius])])[1]
    return [Panel(f"{what} [m]", 2.0, lines, lambda ax: ax.set_ylim(0.0, top))]


def attitude(data: FigureData) -> list[Panel]:
    """Show roll, pitch and yaw."""
    names = ("roll", "pitch", "yaw")
    angles = [np.rad2deg(data.record[f"attitude.{name}"]) for name in names]
    return [Panel("Euler angles, NED to body [°]", 2.0, _lines(names, angles), fit(angles, 2.0))]


def velocities(data: FigureData) -> list[Panel]:
    """Show linear and angular velocity."""
    panels = []
    for names, label, min_spread in (("uvw", "velocity [m/s]", 0.1), ("pqr", "angular velocity [rad/s]", 0.05)):
        signals = [data.record[f"velocity.{name}"] for name in names]
        panels.append(Panel(label, 1.7, _lines(names, signals), fit(signals, min_spread)))
    return panels


def weights_together(data: FigureData) -> list[Panel]:
    """Show the weights of all criteria in one panel."""
    criteria = data.scenario.criteria
    labels = [f"α{i} {criterion.name}" for i, criterion in enumerate(criteria, 1)]
    signals = [data.record[f"weight.{criterion.name}"] for criterion in criteria]
    lines = _lines(labels, signals, [criterion.color for criterion in criteria])
    return [Panel("normalized weight [–]", 2.0, lines, lambda ax: ax.set_ylim(-0.05, 1.05))]


def weights(data: FigureData) -> list[Panel]:
    """Show memberships and weights of each criterion."""
    panels = []
    for i, criterion in enumerate(data.scenario.criteria, 1):
        weight, membership = (data.record[f"{what}.{criterion.name}"] for what in ("weight", "membership"))
        lines = [
            Line("weight, in its criterion's color", weight, {"color": criterion.color, "linewidth": 1.8}),
            Line("membership", membership, {"color": BLACK, "linestyle": ":", "linewidth": 1.0}),
        ]
        label = f"α{i} {criterion.name} [–]"
        panels.append(Panel(label, 0.95, lines, lambda ax: ax.set(ylim=(-0.06, 1.06), yticks=(0.0, 0.5, 1.0))))
    return panels


def clearance(data: FigureData) -> list[Panel]:
    """Show the clearance to each region and to the goal: distances, and angles of attitude regions below."""
    regions = list(regions_of(data.scenario))
    named = _legend_names(data, [region.name for region, _ in regions])
    panels = []
    for unit, height in (("m", 2.5), ("°", 1.5)):
        lines, faint_lines = [], []
        for region, color in regions:
            if of_attitude(region.shape) != (unit == "°"):
                continue
            signal = data.record[f"{region.name}.clearance"]
            signal = np.rad2deg(signal) if unit == "°" else np.where(np.abs(signal) < _AWAY, signal, np.nan)
            if region.name in named:
                i = named.index(region.name)
                style = {"linestyle": DASHES[i % len(DASHES)], "linewidth": 1.3 if i < len(DASHES) else 0.8}
                lines.append(Line(region.name, signal, {"color": color, **style}))
            else:
                label = f"{len(regions) - len(named)} others"
                faint_lines.append(Line(label, signal, {"color": color, "alpha": 0.3, "linewidth": 0.6, "zorder": 1.9}))
        if lines or faint_lines:
            low, high = limits_of([np.asarray(line.signal) for line in (*lines, *faint_lines)])
            low = min(low, -0.08 * (high - min(low, 0.0)))  # always shows some of the range below 0
            limits = low, max(high, -0.2 * low)
            scale = lambda ax, limits=limits: ax.set_ylim(limits)  # noqa: E731
            panels.append(Panel(f"clearance [{unit}]", height, [*lines, *faint_lines], scale, violated=-1.0))
    return panels


def _legend_names(data: FigureData, names: list[str]) -> list[str]:
    """Return the names for the legend: all, or of many regions the goal and the nearest ones."""
    if len(names) <= _NAMED:
        return names
    clearances = data.summary["min_clearance"]
    nearest = sorted(names[1:], key=lambda name: np.nan_to_num(clearances[name], nan=np.inf))[:_NEAREST]
    return [name for name in names if name in (names[0], *nearest)]


def norms_of(record: Rows) -> dict[str, Array]:
    """Return the norms of the acting and the commanded body force, each of shape (rows,) [N]."""
    of = {"acting": "actuation", "asked for": "command"}
    forces = {words: record.stack([f"{name}.{axis}" for axis in "XYZ"]) for words, name in of.items()}
    return {words: np.maximum(np.linalg.norm(force, axis=1), _FLOOR) for words, force in forces.items()}


def forces(data: FigureData) -> list[Panel]:
    """Show the norm of the body force on a logarithmic axis, and its components."""
    norms, acting = norms_of(data.record), [data.record[f"actuation.{a}"] for a in "XYZ"]
    sizes = list(norms.values())
    parts = _lines([f"{axis}, acting" for axis in "XYZ"], acting)
    largest, typical = (percentile(norms["acting"], q) for q in (100, 90))
    scale = fit_spikes(acting, largest, typical, max(typical, 1.0), min_spread=1.0)
    return [
        Panel("force, norm [N]", 1.7, _lines([f"norm, {which}" for which in norms], sizes, (BLACK, RED)),
              lambda ax: log_axis(ax, sizes)),
        Panel("force, body frame [N]", 1.7, parts, scale),
    ]  # fmt: skip


def thruster_caption(scenario: Scenario) -> str:
    """Return the caption of the figure of thrusters."""
    if scenario.actuation.through == "thrusters":
        return "Force of each thruster, and the minimum and maximum of all (dashed black)."
    return (
        "What the acting body wrench would ask of each thruster (pseudo-inverse), and what a thruster gives (dashed "
        "black): in this scenario the wrench acts on the body directly, not through the thrusters."
    )


def thrusts_of(scenario: Scenario, record: Rows) -> Array:
    """Return the force of each thruster, or the one that the wrench would require, shape (rows, thrusters) [N]."""
    vehicle = scenario.vehicle
    if scenario.actuation.through == "thrusters":
        return record.stack([f"thruster_force[{i + 1}]" for i in range(vehicle.n_thrusters)])
    wrench = record.stack([f"actuation.{a}" for a in "XYZKMN"])
    force: Array = wrench @ np.linalg.pinv(vehicle.thruster_matrix).T
    return force


def thrusters(data: FigureData) -> list[Panel]:
    """Show the force of each thruster, or the one that the wrench would require."""
    vehicle, acting = data.scenario.vehicle, thrusts_of(data.scenario, data.record)
    lines = [
        Line(f"thruster {i + 1}", force,
             {"color": CYCLE[i % len(CYCLE)], "linestyle": "-" if i < len(CYCLE) // 2 else "--", "linewidth": 1.0})
        for i, force in enumerate(acting.T)
    ]  # fmt: skip
    bounds = np.array([vehicle.thrust_min.min(), vehicle.thrust_max.max()])
    levels = [Line("", bound, {"color": BLACK, "linestyle": "--", "linewidth": 0.8}) for bound in bounds.tolist()]
    limit = float(np.abs(bounds).max())
    scale = fit_spikes([acting, bounds], percentile(acting, 100), limit, limit, 5.0)
    return [Panel("thrust [N]", 2.3, [*lines, *levels], scale)]


def estimates(data: FigureData) -> list[Panel]:
    """Show the estimates against the truth."""
    truth = data.scenario.true_restoring_parameters
    colors = (BLUE, *CYCLE[1:4])
    signals = [data.record[f"estimate.phi{i}"] for i in range(1, 5)]
    levels = [
        Line("truth", value, {"color": color, "linestyle": (0, (1, 3)), "linewidth": 1.2})
        for value, color in zip(truth.tolist(), colors, strict=True)
    ]
    panels = []
    for label, which in (("estimate [N]", slice(0, 1)), ("estimates [N m]", slice(1, 4))):
        lines = _lines(_ESTIMATES[which], signals[which], colors[which])
        panels.append(Panel(label, 1.6, [*lines, *levels[which]], fit([*signals[which], truth[which]], 0.1)))
    return panels


def lyapunov(data: FigureData) -> list[Panel]:
    """Show V in its three forms, and its rate."""
    printed, normalized, primary, rate = (
        data.record[f"lyapunov.{name}"] for name in ("printed", "normalized", "primary", "rate")
    )
    labels = ("V as printed", "V, potential of the force", "V, primary region alone")
    forms = _lines(labels, (printed, normalized, primary), (ORANGE, BLUE, BLACK))
    scales = []
    for signal in (normalized, rate):
        largest, typical = (percentile(signal, q) for q in (100, 50))
        scales.append(fit_spikes([signal, np.zeros(1)], largest, typical, max(typical, 1e-3 * largest)))
    return [
        Panel("V [N m]", 1.8, forms, scales[0], violated=-1.0),
        Panel("dV/dt = −W [W]", 1.8, [Line("", rate, {"color": BLUE})], scales[1], violated=1.0),
    ]


def control_mode(data: FigureData) -> Figure:
    """Draw the control mode, and the times at which the vehicle is disarmed."""
    figure = draw_panels(data, [Panel("mode [–]", 1.3, [], lambda ax: ax.set_ylim(len(MODES) - 0.4, -0.6))])
    (ax,) = figure.axes
    time, mode = data.record["time"], data.record["commands.mode"]
    changes = [0, *(np.flatnonzero(np.diff(mode) != 0.0) + 1).tolist(), len(time) - 1]
    for first, last in zip(changes, changes[1:], strict=False):
        if np.isfinite(mode[first]):
            row = int(mode[first])
            ax.broken_barh([(time[first], time[last] - time[first])], (row - 0.4, 0.8), color=CYCLE[row])
    for start, end in spans(data.record["commands.armed"] <= 0.0, time):
        ax.axvspan(start, end, color=BLACK, alpha=0.2, linewidth=0)
    ax.set_yticks(range(len(MODES)), labels=MODES)
    return figure
