"""FMPy's validation of a model description: its schema, names, start values, units and structure."""

from __future__ import annotations

from pathlib import Path

from fmpy.validation import validate_fmu

from plant_fmu.errors import ImporterError
from plant_fmu.importers.fmu_file import FmuFile
from plant_fmu.importers.task import Answer, Task


def run(fmu: FmuFile, task: Task, folder: Path) -> Answer:
    """Validate an FMU; `plant_fmu.importers.registry` defines for which it applies.

    An ImporterError names the first defect.
    """
    problems = validate_fmu(str(fmu.path))
    if problems:
        raise ImporterError(f"problems found: {len(problems)}; first: {problems[0]}")
    return Answer(note="no problems found")
