"""A scenario as a system of FMUs that other masters run: plant, controller and arbiter, without Python."""

from cosim.package.arbiter import arbiter_component
from cosim.package.controller import controller_component
from cosim.package.system import package_system, plant_component

__all__ = ["arbiter_component", "controller_component", "package_system", "plant_component"]
