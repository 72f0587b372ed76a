"""Identification from run folders to a vehicle's file and its page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from cosim.errors import IdentificationError
from cosim.identification import findings
from cosim.identification.fit import Fit, fit
from cosim.identification.log import Log, load_log
from cosim.identification.parameters import (
    DEFAULT_FREE,
    DEFAULT_NUISANCES,
    RANDOM_FORCE,
    free_parameters,
    nuisances,
    with_mean_nuisances,
)
from cosim.identification.validation import Prediction, validate
from cosim.identification.vehicle_file import name_of_file, vehicle_text
from plant_fmu.vehicle import Vehicle, load_vehicle


@dataclass(frozen=True)
class Identification:
    """An identification with its runs, fit and validation."""

    start: str  # name of the shipped vehicle, or path of the file, with the start values of the search
    vehicle: Vehicle  # vehicle of `start`, loaded
    logs: tuple[Log, ...]  # fitted runs
    held_out: tuple[Log, ...]  # runs for validation, not fitted
    fit: Fit
    predictions: tuple[Prediction, ...]  # prediction errors of the runs held out, or without them of the fitted ones


def identify(
    runs: Sequence[Path],
    start: str,
    free: Sequence[str] = DEFAULT_FREE,
    nuisance: Sequence[str] = DEFAULT_NUISANCES,
    held_out: Sequence[Path] = (),
    progress: Callable[[float], None] = lambda part: None,
) -> Identification:
    """Identify parameters of a vehicle from recorded runs."""
    if not runs:
        raise IdentificationError("no run is given, expected one at the least")
    vehicle = load_vehicle(start)
    parameters = free_parameters(vehicle, free)
    if not parameters:
        raise IdentificationError("--free: nothing is free, expected one key at the least")
    logs, others = (tuple(load_log(run, vehicle) for run in folders) for folders in (runs, held_out))
    parameters += nuisances(nuisance, logs)
    try:
        found = fit(logs, vehicle, parameters, progress, RANDOM_FORCE in nuisance)
    except IdentificationError as error:
        slow = [said for log in logs if (said := findings.slow_commands(log))]
        if not slow:
            raise
        raise IdentificationError(f"{error}. {' '.join(slow)}") from error
    findings.require_apart(found)
    if others:
        predictions = validate(others, vehicle, *with_mean_nuisances(parameters, found.values), found.step)
    else:
        predictions = validate(logs, vehicle, parameters, found.values, found.step)
    return Identification(start, vehicle, logs, others, found, tuple(predictions))


def vehicle_contents(done: Identification, out: Path) -> str:
    """Return the content of the identified vehicle's file `out`; raise IdentificationError if its name is invalid."""
    names = ", ".join(log.name for log in done.logs)
    provenance = [
        f"Identified by cosim identify from {names}, starting from {done.vehicle.name}. Behind a number stands half of "
        "its 95 % interval.",
        findings.verdict(done.fit),
        *findings.warnings(done.fit, done.logs),
    ]
    return vehicle_text(done.start, done.vehicle, done.fit, name_of_file(out), provenance)
