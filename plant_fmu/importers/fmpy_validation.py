"""FMPy's validation of a model description: its schema, names, start values, units and structure."""

from __future__ import annotations

from pathlib import Path

from fmpy import read_model_description
from fmpy.model_description import ValidationError

from plant_fmu.errors import ImporterError
from plant_fmu.importers.fmu_file import FmuFile
from plant_fmu.importers.task import Answer, Task

_MAX_NAMES = 20_000  # greatest number of names that are parsed, each of which takes a millisecond


def run(fmu: FmuFile, task: Task, folder: Path) -> Answer:
    """Validate an FMU; `plant_fmu.importers.registry` defines for which it applies.

    An ImporterError names the first defect.
    """
    with_names = len(fmu.variables) <= _MAX_NAMES
    try:
        read_model_description(
            str(fmu.path), validate=True, validate_variable_names=with_names, validate_model_structure=True
        )
    except ValidationError as error:
        raise ImporterError(f"problems found: {len(error.problems)}; first: {error.problems[0]}") from error
    except Exception as error:
        raise ImporterError(f"problems found: 1; first: {error}") from error
    return Answer(note="no problems found" if with_names else "no problems found; so many names are not checked")
