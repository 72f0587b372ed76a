"""Vehicles drawn from the uncertainty of an identification, as plants of a sweep."""

from __future__ import annotations

import json

import numpy as np
from numpy.typing import NDArray

from cosim.errors import IdentificationError
from cosim.identification.fit import Fit
from cosim.identification.parameters import with_values
from plant_fmu.vehicle import Vehicle

Array = NDArray[np.float64]

DRAWS = 256  # number of drawn vehicles
_TRIES = 100  # most tries per drawn vehicle, until its mass matrix is positive definite


def posterior_lines(fit: Fit, vehicle: Vehicle) -> list[str]:
    """Draw vehicles from an identification that began at `vehicle`; return a line of JSON for each."""
    return [json.dumps({"draw": i, "parameters": p}) for i, p in enumerate(draw_plants(fit, vehicle, seed=0))]


def draw_plants(fit: Fit, vehicle: Vehicle, seed: int, count: int = DRAWS) -> list[dict[str, float]]:
    """Draw parameters of the FMU from the normal distribution of the identified numbers."""
    places = fit.vehicle_part()
    parameters = [fit.parameters[i] for i in places]
    least, most = (np.array([getattr(p, name) for p in parameters]) for name in ("least", "most"))
    covariance = fit.intervals.covariance[np.ix_(places, places)]
    rng = np.random.default_rng([seed, 28])
    found: list[dict[str, float]] = []
    for _ in range(_TRIES * count):
        values = np.clip(rng.multivariate_normal(fit.values[places], covariance), least, most)
        body = with_values(vehicle, parameters, values)
        if np.linalg.eigvalsh(body.mass_matrix)[0] <= 0.0:
            continue
        plant: dict[str, float] = {}
        for p, value in zip(parameters, values, strict=True):
            if p.kind == "lag":
                plant |= {f"thrust_time_constant[{i + 1}]": float(value) for i in range(vehicle.n_thrusters)}
            elif p.kind == "thrust":
                column = body.thruster_matrix[:, p.index]
                plant |= {f"thruster_matrix[{k + 1},{p.index + 1}]": float(column[k]) for k in np.flatnonzero(column)}
            else:
                plant[p.plant] = float(value)
        found.append(plant)
        if len(found) == count:
            return found
    raise IdentificationError("hardly any vehicle within the intervals has a positive definite mass matrix")
