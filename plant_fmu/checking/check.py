"""Check an FMU: validate it, simulate it in FMPy and in `Plant`, and compare the results."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

from plant_fmu.checking.fmu_file import FmuFile, read_fmu
from plant_fmu.checking.process import Importer, run_importer
from plant_fmu.checking.task import Result, Task
from plant_fmu.errors import TaskError
from plant_fmu.toml_tables import hint
from plant_fmu.variables.former_names import present_name

REFERENCE = "FMPy"  # importer with which the others are compared
CS_TOLERANCE = 1e-9  # relative to the larger of an output and one: two masters differ in how they add up the time


def _lacks_state(fmu: FmuFile) -> str:
    offered = fmu.offers("CS", "canGetAndSetFMUState")
    return "" if offered else "the FMU cannot save its state (canGetAndSetFMUState)"


IMPORTERS = (
    Importer("FMPy validation", "plant_fmu.checking.drivers:validate", ""),
    Importer("FMPy", "plant_fmu.checking.drivers:simulate_in_fmpy", "CS"),
    Importer("FMPy FMU state", "plant_fmu.checking.drivers:resume_in_fmpy", "CS", _lacks_state),
    Importer("Plant, through FMPy", "plant_fmu.checking.drivers:simulate_in_plant", "CS"),
)


def check_fmu(
    path: Path,
    stop_time: float | None = None,
    step: float | None = None,
    start: Mapping[str, float] | None = None,
    importers: Sequence[Importer] = IMPORTERS,
) -> list[Result]:
    """Run every importer on an FMU, and compare its outputs at the stop time with those of FMPy's co-simulation."""
    # Units of arguments: stop_time, step [s]
    # A co-simulation that differs from FMPy's has failed. Model exchange has not: it compares the importer's integrator
    # with the one inside the FMU.
    fmu = read_fmu(path)
    known = {v.name: v for v in fmu.variables if v.is_real}
    task = Task(
        fmu.stop_time if stop_time is None else stop_time, fmu.step if step is None else step,
        {present_name(name, known): value for name, value in (start or {}).items()},
    )  # fmt: skip
    for name in task.start:
        if name not in known:
            raise TaskError(f"{path}: no real variable is named {name!r}; {hint(name, known)}")
    with ThreadPoolExecutor(os.cpu_count()) as pool:  # each waits for its process
        results = list(pool.map(lambda importer: run_importer(importer, fmu, task), importers))
    reference = next(result for result in results if result.importer == REFERENCE)
    return [_compare(result, reference) for result in results]


def _compare(result: Result, reference: Result) -> Result:
    if result is reference or not (result.values and reference.values):
        return result
    differences = {name: abs(value - reference.values[name]) for name, value in result.values.items()}
    # a comparison with NaN is never true, but a reader must see it as the largest difference
    differences = {name: d if d >= 0.0 else math.inf for name, d in differences.items()}
    scaled = {name: d / max(1.0, abs(reference.values[name])) for name, d in differences.items()}
    worst = max(scaled, key=scaled.__getitem__)
    if result.interface == "CS" and not scaled[worst] <= CS_TOLERANCE:
        note = f"{worst} ends at {result.values[worst]!r}, but at {reference.values[worst]!r} in {REFERENCE}"
        result = replace(result, status="failed", note=note)
    return replace(result, difference=max(differences.values()))
