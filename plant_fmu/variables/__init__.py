"""The variables of the FMUs: one of them, the table of a vehicle's, and those of coupling.

Imports: nothing.
"""

from plant_fmu.variables.table import variables
from plant_fmu.variables.variable import AXES, FORCES, VELOCITIES, Role, Variable

__all__ = ["AXES", "FORCES", "VELOCITIES", "Role", "Variable", "variables"]
