"""The path of a vehicle, thinned for drawing, with active criteria, overlap and targets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cosim.replay.activity import active_at, activity_signals
from cosim.report.figures.style import POINTS, FigureData
from cosim.simulation.signals import Array

_TARGETS = 12  # maximum number of targets that are drawn
POSITION = ("position.x", "position.y", "position.z")


@dataclass(frozen=True)
class SampledPath:
    """Points of a path, evenly spaced along its length."""

    points: Array  # (n, 3) m, NED
    active_criterion: NDArray[np.intp]  # (n,) index of the active region's criterion, -1 for the goal
    overlap: NDArray[np.bool_]  # (n,) True in the overlap of the scenario's regions
    targets: list[tuple[Array, float]]  # earlier targets: center [m, NED] and radius [m], 0 for that of the goal


def is_known(data: FigureData) -> bool:
    """Return True if the record has a finite position of the vehicle."""
    return bool(np.isfinite(data.record.stack(POSITION)).all(axis=1).any())


def sample_path(data: FigureData) -> SampledPath:
    """Sample the path of a run."""
    path = data.record.stack(POSITION)
    known = np.flatnonzero(np.isfinite(path).all(axis=1))
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path[known], axis=0), axis=1))])
    indices = np.searchsorted(length, np.linspace(0.0, length[-1], POINTS))
    samples = known[np.unique(np.minimum(indices, len(known) - 1))]
    return SampledPath(
        path[samples],
        _active_criterion(data, samples),
        _overlap(data)[samples],
        targets_of(data),
    )


def targets_of(data: FigureData) -> list[tuple[Array, float]]:
    """Return the targets that were commanded before the last one: center [m, NED] and radius [m]; returns (3,)."""
    if not data.scenario.commands.enabled:
        return []
    targets = data.record.stack([*(f"target.{axis}" for axis in "xyz"), "target.radius"])
    targets = targets[np.isfinite(targets).all(axis=1)]
    changes = np.flatnonzero((np.diff(targets, axis=0) != 0.0).any(axis=1))  # the last row of each
    selected = changes[np.unique(np.linspace(0, len(changes) - 1, min(len(changes), _TARGETS)).round().astype(int))]
    return [(targets[i, :3], float(targets[i, 3])) for i in selected]


def _overlap(data: FigureData) -> NDArray[np.bool_]:
    """Return a mask of the steps within the summary's windows of overlap of regions, shape (steps,)."""
    time, windows = data.record["time"], np.array(data.summary["intersection_windows"]).reshape(-1, 2)
    begun = np.searchsorted(windows[:, 0], time, "right")  # number of windows begun; they do not overlap
    inside: NDArray[np.bool_] = (begun > 0) & (time <= np.append(windows[:, 1], 0.0)[begun - 1])
    return inside


def _active_criterion(data: FigureData, samples: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the index of the active region's criterion at rows `samples`, -1 for the goal."""
    if not data.scenario.regions:
        return np.full(len(samples), -1)
    active = active_at(data.scenario, data.record.take(samples, activity_signals(data.scenario)))
    active_criterion: NDArray[np.intp] = np.array([-1, *data.scenario.criterion_places])[active]
    return active_criterion
