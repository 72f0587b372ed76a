"""Causes of a poor fit: the fixed numbers that would explain most of its residuals if they were free."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cosim.errors import IdentificationError
from cosim.identification.log import Log
from cosim.identification.parameters import NUISANCES, RANDOM_FORCE, free_parameters, nuisances
from cosim.identification.residuals import Residuals, normal_equations
from cosim.simulation.signals import Array
from plant_fmu.vehicle import Vehicle


@dataclass(frozen=True)
class Cause:
    """A group of fixed numbers, and the share of the residuals that it would explain."""

    flag: str  # command-line flag that frees the group
    fraction: float  # explained fraction of the sum of squares beyond the noise, by one Gauss-Newton step


def find_causes(logs: Sequence[Log], vehicle: Vehicle, fitted: Residuals, values: Array, step: float) -> list[Cause]:
    """Find the causes of a poor fit, by a score test of each group of fixed numbers (Rao 1948); step [s]."""
    parameters = fitted.parameters
    kinds = {p.kind for p in parameters}
    groups = {f"--nuisance {name}": nuisances((name,), logs) for name in NUISANCES if name not in kinds}
    free_keys = {".".join(p.name.split(".")[:2]) for p in parameters}
    for key in ("thrusters.matrix", "thrusters.time_constant", "hydrostatics.trim", "sensors.dvl_position"):
        if key not in free_keys:
            groups[f"--free {key}"] = free_parameters(vehicle, (key,))
    every = [*parameters, *(p for group in groups.values() for p in group)]
    extended = np.concatenate([values, [p.start for p in every[len(values) :]]])
    has_force = fitted.force_deviation is not None
    problem = Residuals(logs, vehicle, every, fitted.windows, step, has_force)
    problem.force_deviation = fitted.force_deviation
    try:
        problem.weigh_as(fitted)
        information, score, squares, rows = normal_equations(problem, extended)
    except IdentificationError:
        return []
    excess, free, causes = squares - rows, list(range(len(values))), []
    if excess <= 0.0:
        return []
    explained = _explained(information, score, free)
    if not has_force:
        forced = Residuals(logs, vehicle, parameters, fitted.windows, step, random_force=True)
        with contextlib.suppress(IdentificationError):  # then a force explains nothing
            forced.weigh_as(fitted)
            own_information, own_score, own_squares, _ = normal_equations(forced, values)
            left = own_squares - _explained(own_information, own_score, free)
            causes.append(Cause(f"--nuisance {RANDOM_FORCE}", (squares - explained - left) / excess))
    count = len(values)
    for flag, group in groups.items():
        added = _explained(information, score, free + list(range(count, count + len(group)))) - explained
        causes.append(Cause(flag, added / excess))
        count += len(group)
    return sorted(causes, key=lambda cause: -cause.fraction)


def _explained(information: Array, score: Array, free: list[int]) -> float:
    """Return the sum of squares that one Gauss-Newton step of the free parameters explains."""
    return float(score[free] @ np.linalg.solve(information[np.ix_(free, free)], score[free]))
