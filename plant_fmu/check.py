"""Run every installed validator and importer on one FMU, and compare the results of those that simulate it."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

from plant_fmu.errors import TaskError
from plant_fmu.importers import IMPORTERS, Result, Task, read_fmu, run_importer
from plant_fmu.toml_tables import hint

REFERENCE = "FMPy"  # importer with which the others are compared
CS_TOLERANCE = 1e-9  # relative to the greater of an output and one: two masters differ in how they add up the time


@dataclass(frozen=True)
class Verdict:
    """One importer's result, and its greatest difference of an output at the stop time to FMPy's co-simulation."""

    result: Result
    difference: float | None = None  # greatest difference, in the output's unit; None without a comparison


def check_fmu(
    path: Path,
    stop_time: float | None = None,
    step: float | None = None,
    start: Mapping[str, float] | None = None,
) -> list[Verdict]:
    """Run every validator and importer on an FMU.

    Co-simulation by an importer is a failure too where it differs from FMPy's. Model exchange is not: an integrator of
    the importer's is compared with the one inside the FMU there.

    Parameters
    ----------
    path : Path
        Path of the FMU, whose binary is run with the rights of this user.
    stop_time, step : float, optional
        End and step [s]. Default: those of the FMU's default experiment, else 10 and 0.01.
    start : mapping from str to float, optional
        Start values of parameters, inputs and states, by name.

    Returns
    -------
    list of Verdict
        A verdict for each importer, installed or not.

    Raises
    ------
    FmuFileError
        If the file is no FMU, or is not safe to extract.
    TaskError
        If the times do not fit, or the FMU has no such variable.
    """
    fmu = read_fmu(path)
    task = Task(
        fmu.stop_time if stop_time is None else stop_time, fmu.step if step is None else step, dict(start or {})
    )
    known = {v.name: v for v in fmu.variables if v.is_real}
    for name in task.start:
        if name not in known:
            raise TaskError(f"{path}: no real variable is named {name!r}; {hint(name, known)}")
    with ThreadPoolExecutor(os.cpu_count()) as pool:  # each waits for its process
        results = list(pool.map(lambda importer: run_importer(importer, fmu, task), IMPORTERS))
    reference = next(result for result in results if result.importer == REFERENCE)
    return [_compare(result, reference) for result in results]


def _compare(result: Result, reference: Result) -> Verdict:
    if result is reference or not (result.values and reference.values):
        return Verdict(result)
    differences = {name: abs(value - reference.values[name]) for name, value in result.values.items()}
    # a comparison with NaN is never true, but a reader must see it as the greatest difference
    found = {name: difference if difference >= 0.0 else math.inf for name, difference in differences.items()}
    scaled = {name: difference / max(1.0, abs(reference.values[name])) for name, difference in found.items()}
    furthest = max(scaled, key=scaled.__getitem__)
    if result.interface == "CS" and not scaled[furthest] <= CS_TOLERANCE:
        note = f"{furthest} ends at {result.values[furthest]!r}, but at {reference.values[furthest]!r} in {REFERENCE}"
        result = replace(result, status="failed", note=note)
    return Verdict(result, max(found.values()))
