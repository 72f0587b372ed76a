"""The checks of the FMU manipulation toolbox: the schema, and rules that no schema can express."""

from __future__ import annotations

import logging
from pathlib import Path

from fmu_manipulation_toolbox.checker import get_checkers
from fmu_manipulation_toolbox.operations import FMU

from plant_fmu.checking.drivers import Answer
from plant_fmu.checking.fmu_file import FmuFile
from plant_fmu.checking.task import Task
from plant_fmu.errors import ImporterError


class _Complaints(logging.Handler):
    """Collect log records of errors, through which the checks report."""

    def __init__(self) -> None:
        super().__init__(level=logging.ERROR)
        self.texts: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.texts.append(record.getMessage())


def run(fmu: FmuFile, task: Task, folder: Path) -> Answer:
    """Apply every check the toolbox has to an FMU.

    An ImporterError names the first defect.
    """
    complaints = _Complaints()
    logging.getLogger("fmu_manipulation_toolbox").addHandler(complaints)
    checks = [check() for check in get_checkers()]
    with FMU(str(fmu.path)) as opened:
        for check in checks:
            opened.apply_operation(check)
    if complaints.texts:
        raise ImporterError(f"problems found: {len(complaints.texts)}; first: {complaints.texts[0]}")
    return {}, f"no problems found by {len(checks)} checks"
