"""Systems of FMUs, as SSP files.

Write a scenario as one that other masters run without Python: plant, controller, arbiter, and FMUs of the user's. Read
and step any such file, or write it as one FMU.

Imports: controller, fuzzy_arbiter, plant_fmu, results, scenario, simulation, step.
"""

from cosim.ssp.arbiter import arbiter_component
from cosim.ssp.container import write_container
from cosim.ssp.controller import controller_component
from cosim.ssp.system import package_system, plant_component

__all__ = ["arbiter_component", "controller_component", "package_system", "plant_component", "write_container"]
