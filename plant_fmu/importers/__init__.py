"""Importers of other tools, and `Plant`, each run on an FMU in a process of its own, with their answers in one form.

Imports: running.
"""

from plant_fmu.importers.fmu_file import FmuFile, FmuVariable, read_fmu
from plant_fmu.importers.process import run_importer
from plant_fmu.importers.registry import IMPORTERS, Importer
from plant_fmu.importers.task import Jacobian, Result, Task

__all__ = [
    "IMPORTERS",
    "FmuFile",
    "FmuVariable",
    "Importer",
    "Jacobian",
    "Result",
    "Task",
    "read_fmu",
    "run_importer",
]
