"""Vehicles drawn from the uncertainty of an identification, as plants of a sweep."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cosim.errors import IdentificationError
from cosim.identification.fit import Fit
from cosim.identification.parameters import with_values
from cosim.io.atomic_file import write_atomic
from plant_fmu.vehicle import Vehicle

Array = NDArray[np.float64]

DRAWS = 256  # number of drawn vehicles
_TRIES = 100  # most tries per drawn vehicle, until its mass matrix is positive definite


def write_posterior(fit: Fit, vehicle: Vehicle, out: Path) -> Path:
    """Write vehicles drawn from an identification beside its vehicle's file, one per line.

    Parameters
    ----------
    fit : Fit
        Fit, for its values and the covariance of the jackknife.
    vehicle : Vehicle
        Vehicle with the start values of the search.
    out : Path
        Path of the identified vehicle's file.

    Returns
    -------
    Path
        Path of the written file: that of the vehicle's file, with ``.posterior.jsonl``.

    Raises
    ------
    IdentificationError
        If the file cannot be written, or hardly any draw has a positive definite mass matrix.
    """
    path = out.with_suffix(".posterior.jsonl")
    lines = [json.dumps({"draw": i, "parameters": p}) for i, p in enumerate(draw_plants(fit, vehicle, seed=0))]
    try:
        write_atomic(path, "".join(f"{line}\n" for line in lines))
    except OSError as error:
        raise IdentificationError(f"{path}: {error.strerror or error}") from error
    return path


def draw_plants(fit: Fit, vehicle: Vehicle, seed: int, count: int = DRAWS) -> list[dict[str, float]]:
    """Draw parameters of the FMU from the normal distribution of the identified numbers.

    Parameters
    ----------
    fit : Fit
        Fit, for its values and covariance. 95 % of the draws lie within a number's 95 % interval; those beyond a bound
        are clipped to it.
    vehicle : Vehicle
        Vehicle with the start values of the search.
    seed : int
        Seed of the draws.
    count : int
        Number of draws.

    Returns
    -------
    list of dict of str to float
        Values of each draw by the names of the FMU's parameters, in SI units.

    Raises
    ------
    IdentificationError
        If hardly any draw has a positive definite mass matrix.
    """
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
