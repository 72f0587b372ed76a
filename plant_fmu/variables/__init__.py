"""The variables of the FMUs: one of them, the table of a vehicle's, those of coupling, and arrays.

Imports: nothing.
"""

from plant_fmu.variables.arrays import described, show_small, with_arrays
from plant_fmu.variables.table import variables
from plant_fmu.variables.variable import AXES, FORCES, VELOCITIES, Role, Variable

__all__ = [
    "AXES", "FORCES", "VELOCITIES", "Role", "Variable", "described", "show_small", "variables", "with_arrays",
]  # fmt: skip
