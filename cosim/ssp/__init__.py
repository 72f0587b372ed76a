"""A scenario as a system of FMUs.

Plant, controller and arbiter as three FMUs in one SSP 1.0 file, which other masters run without Python.

Imports: controller, fuzzy_arbiter, plant_fmu, results, scenario, simulation, step.
"""

from cosim.ssp.arbiter import arbiter_component
from cosim.ssp.container import write_container
from cosim.ssp.controller import controller_component
from cosim.ssp.system import package_system, plant_component

__all__ = ["arbiter_component", "controller_component", "package_system", "plant_component", "write_container"]
