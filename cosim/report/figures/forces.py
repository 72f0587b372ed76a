"""Figures of forces, thrusters and estimates over time."""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure

from cosim.report.figures.layout import legend, limits_of, log_axis, symlog_axis
from cosim.report.figures.style import BLACK, BLUE, CYCLE, GREEN, RED, FigureData
from cosim.report.figures.time_series import DASHES, curve, over_time
from cosim.results.record import Rows
from cosim.scenario.scenario import Scenario
from cosim.simulation.signals import Array

_FLOOR = 1e-2  # N, minimum value on a logarithmic axis
_ESTIMATES = ("W − B", "x_G W − x_B B", "y_G W − y_B B", "z_G W − z_B B")


def norms_of(record: Rows) -> dict[str, Array]:
    """Return the norms of the acting and the commanded body force, each of shape (rows,) [N]."""
    of = {"acting": "actuation", "asked for": "command"}
    forces = {words: record.stack([f"{name}.{axis}" for axis in "XYZ"]) for words, name in of.items()}
    return {words: np.maximum(np.linalg.norm(force, axis=1), _FLOOR) for words, force in forces.items()}


def forces(data: FigureData) -> Figure:
    """Draw the norm of the body force on a logarithmic axis, and its components."""
    acting = data.record.stack([f"actuation.{a}" for a in "XYZ"])
    norms = norms_of(data.record)
    names = [f"{axis}, acting" for axis in "XYZ"]
    labels = [f"norm, {which}" for which in norms] + names
    figure, (norm, parts) = over_time(data, [1.7, 1.7], labels)
    entries: dict[str, Artist] = {}
    for label, force, color, dashes in zip(labels, norms.values(), (BLACK, RED), DASHES, strict=False):
        entries[label] = curve(norm, data, force, color=color, linestyle=dashes)
    log_axis(norm, list(norms.values()))
    norm.set_ylabel("force, norm [N]")
    for i, (name, color, dashes) in enumerate(zip(names, (BLUE, RED, GREEN), DASHES, strict=False)):
        entries[name] = curve(parts, data, acting[:, i], color=color, linestyle=dashes)
    size = norms["acting"][np.isfinite(norms["acting"])]
    largest, typical = (float(size.max()), float(np.percentile(size, 90))) if size.size else (0.0, 0.0)
    if largest > 20.0 * max(typical, 1.0):  # on a linear axis a spike would hide the rest
        symlog_axis(parts, largest, max(typical, 1.0))
    else:
        parts.set_ylim(*limits_of([acting], least=1.0))
    parts.set_ylabel("force, body frame [N]")
    legend(figure, entries)
    return figure


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


def thrusters(data: FigureData) -> Figure:
    """Draw the force of each thruster, or the one that the wrench would require."""
    vehicle = data.scenario.vehicle
    force = thrusts_of(data.scenario, data.record)
    labels = [f"thruster {i + 1}" for i in range(vehicle.n_thrusters)]
    figure, (ax,) = over_time(data, [2.3], labels)
    entries: dict[str, Artist] = {}
    for i, label in enumerate(labels):
        style = "-" if i < len(CYCLE) // 2 else "--"
        entries[label] = curve(ax, data, force[:, i], color=CYCLE[i % len(CYCLE)], linestyle=style, linewidth=1.0)
    bounds = float(vehicle.thrust_min.min()), float(vehicle.thrust_max.max())
    for bound in bounds:
        ax.axhline(bound, color=BLACK, linestyle="--", linewidth=0.8)
    size = np.abs(force[np.isfinite(force)])
    largest, limit = float(size.max(initial=0.0)), max(bounds[1], -bounds[0])
    if largest > 5.0 * limit:
        symlog_axis(ax, largest, limit)
    else:
        ax.set_ylim(*limits_of([force, np.array(bounds)]))
    ax.set_ylabel("thrust [N]")
    legend(figure, entries)
    return figure


def estimates(data: FigureData) -> Figure:
    """Draw the estimates against the truth."""
    true_values = data.scenario.true_restoring_parameters
    labels = list(_ESTIMATES)
    figure, (force, moment) = over_time(data, [1.6, 1.6], [*labels, "truth"])
    entries: dict[str, Artist] = {}
    shown: dict[bool, list[Array]] = {True: [], False: []}
    for i, label in enumerate(labels):
        ax, color = (force, BLUE) if i == 0 else (moment, CYCLE[i])
        signal = data.record[f"estimate.phi{i + 1}"]
        entries[label] = curve(ax, data, signal, color=color, linestyle=DASHES[max(0, i - 1)])
        entries["truth"] = ax.axhline(true_values[i], color=color, linestyle=(0, (1, 3)), linewidth=1.2)
        shown[i == 0] += [signal, true_values[i : i + 1]]
    force.set_ylim(*limits_of(shown[True], least=0.1))
    moment.set_ylim(*limits_of(shown[False], least=0.1))
    force.set_ylabel("estimate [N]")
    moment.set_ylabel("estimates [N m]")
    legend(figure, {label: entries[label] for label in (*labels, "truth")})
    return figure
