"""Causes of a poor fit: the fixed numbers that would explain most of its residuals if they were free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cosim.errors import IdentificationError
from cosim.identification.log import Log
from cosim.identification.parameters import NUISANCES, RANDOM_FORCE, Parameter, free_parameters, nuisances
from cosim.identification.residuals import Reduced, Residuals
from plant_fmu.vehicle import Vehicle

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Cause:
    """A group of fixed numbers, and the share of the residuals that it would explain."""

    flag: str  # command-line flag that frees the group
    share: float  # explained fraction of the sum of squares beyond the noise, by one Gauss-Newton step


def find_causes(logs: Sequence[Log], vehicle: Vehicle, fitted: Residuals, values: Array, step: float) -> list[Cause]:
    """Find the causes of a poor fit, by a score test of each group of fixed numbers (Rao 1948); step [s]."""
    parameters, windows = fitted.parameters, fitted.windows
    kinds = {p.kind for p in parameters}
    groups = {f"--nuisance {name}": nuisances((name,), logs) for name in NUISANCES if name not in kinds}
    if "thrust" not in kinds:
        groups["--free thrusters.matrix"] = free_parameters(vehicle, ("thrusters.matrix",))
    if "lag" not in kinds:
        groups["--free thrusters.time_constant"] = free_parameters(vehicle, ("thrusters.time_constant",))
    every = [*parameters, *(p for group in groups.values() for p in group)]
    problem = Residuals(logs, vehicle, every, windows, step, fitted.force_deviation is not None)
    problem.force_deviation = fitted.force_deviation
    problem.weigh_as(fitted)
    at = np.concatenate([values, [p.start for p in every[len(values) :]]])
    settings = problem.settings(at)
    try:
        reduced = [problem.reduced(i, settings, at) for i in range(len(windows))]
    except IdentificationError:
        return []
    information, score, squares = _normal_equations(every, reduced, at)
    excess = squares - sum(len(r.residual) for r in reduced)
    if excess <= 0.0:
        return []

    def explained(places: list[int]) -> float:
        return float(score[places] @ np.linalg.solve(information[np.ix_(places, places)], score[places]))

    free, count, found = list(range(len(values))), len(values), list[Cause]()
    already = explained(free)
    if fitted.force_deviation is None:
        left = _left_by_random_force(
            Residuals(logs, vehicle, parameters, windows, step, random_force=True), fitted, values
        )
        found.append(Cause(f"--nuisance {RANDOM_FORCE}", (squares - already - left) / excess))
    for flag, group in groups.items():
        own = list(range(count, count + len(group)))
        count += len(group)
        found.append(Cause(flag, (explained(free + own) - already) / excess))
    return sorted(found, key=lambda cause: -cause.share)


def _left_by_random_force(forced: Residuals, fitted: Residuals, values: Array) -> float:
    """Return the sum of squares after one Gauss-Newton step with a constant force in each window; inf if that fails."""
    forced.weigh_as(fitted)
    settings = forced.settings(values)
    try:
        reduced = [forced.reduced(i, settings, values) for i in range(len(forced.windows))]
    except IdentificationError:
        return np.inf
    information, score, squares = _normal_equations(forced.parameters, reduced, values)
    return squares - float(score @ np.linalg.solve(information, score))


def _normal_equations(
    parameters: Sequence[Parameter], reduced: Sequence[Reduced], values: Array
) -> tuple[Array, Array, float]:
    """Return information, score and sum of squares of one Gauss-Newton step."""
    deviation, start = (np.array([getattr(p, name) for p in parameters]) for name in ("deviation", "start"))
    information = np.diag(deviation**-2.0) + sum(r.jacobian.T @ r.jacobian for r in reduced)
    score = (values - start) / deviation**2 + sum(r.jacobian.T @ r.residual for r in reduced)
    return information, score, sum(float(r.residual @ r.residual) for r in reduced)
