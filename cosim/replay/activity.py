"""The active region of each row, from weights and memberships."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cosim.results.record import Rows
from cosim.scenario.scenario import Scenario
from cosim.simulation.signals import Array

_RESTING_SIGNALS = ("goal.clearance", "velocity.u", "velocity.v", "velocity.w")  # signals that `is_resting` needs
_SLOW = 0.02  # m/s over ground, below which the vehicle rests
_MIN_ACTIVE_WEIGHT = 0.005  # weight below which a criterion is not active: it is shown as 0.00
_DOMINANT_WEIGHT = 0.5  # weight from which a criterion is active even if the vehicle rests in the goal


def is_resting(goal: Array, velocity: Array) -> NDArray[np.bool_]:
    """Return a mask of the rows in which the vehicle rests in the goal region: slower than 0.02 m/s; goal [m]."""
    # Units of arguments: velocity [m/s]
    slow: NDArray[np.bool_] = np.linalg.norm(velocity, axis=1) < _SLOW
    return slow & (goal >= 0.0)


def active_regions(
    criteria: Sequence[int], memberships: Array, weights: Array, clearances: Array, resting: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return the active region of each row; clearances [m or rad]."""
    # It is the most critical region, that of the minimum clearance, of the criterion with the maximum weight. It is the
    # goal if the membership of that criterion is 0, or its weight below 0.005; also if the vehicle rests in the goal
    # region, the criterion weighs less than 0.5, and its region is satisfied.
    rows = np.arange(len(weights))
    criterion = np.argmax(np.where(np.isnan(weights), -np.inf, weights), axis=1)
    criterion_of_region = np.array(criteria, dtype=int)
    if not criterion_of_region.size:
        return np.zeros(len(rows))
    belongs = criterion_of_region[None, :] == criterion[:, None]
    critical = np.where(belongs & ~np.isnan(clearances), clearances, np.inf)
    is_secondary = (memberships[rows, criterion] > 0.0) & (weights[rows, criterion] >= _MIN_ACTIVE_WEIGHT)
    is_secondary &= np.isfinite(critical).any(axis=1)
    is_secondary &= ~resting | (weights[rows, criterion] >= _DOMINANT_WEIGHT) | (critical.min(axis=1) < 0.0)
    return np.where(is_secondary, np.argmin(critical, axis=1) + 1, 0).astype(float)


def activity_signals(scenario: Scenario) -> list[str]:
    """Return the names of the signals that `active_at` needs."""
    names = [f"{kind}.{name}" for kind in ("membership", "weight") for name in scenario.criterion_names]
    return [*_RESTING_SIGNALS, *names, *(f"{secondary.region.name}.clearance" for secondary in scenario.regions)]


def active_at(scenario: Scenario, rows: Rows) -> NDArray[np.intp]:
    """Return the index of the active region at each row of a run, shape (rows,): 0 for the goal."""
    n, signals = len(scenario.criteria), rows.stack(activity_signals(scenario))
    goal, velocity, memberships, weights, clearances = np.split(signals, [1, 4, 4 + n, 4 + 2 * n], axis=1)
    resting = is_resting(goal[:, 0], velocity)
    return active_regions(scenario.criterion_places, memberships, weights, clearances, resting).astype(np.intp)
