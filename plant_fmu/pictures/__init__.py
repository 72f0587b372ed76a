"""Pictures of a vehicle: lines of action of its thrusters, and the variables of its FMU.

Every function returns a new figure; none shows or saves anything. Matplotlib is needed only when one is called.

Imports: variables.
"""

from plant_fmu.pictures.files import IMAGES, image
from plant_fmu.pictures.thruster_layout import thrusters
from plant_fmu.pictures.variable_map import variable_map

PICTURES = {"thrusters": thrusters, "variables": variable_map}

__all__ = ["IMAGES", "PICTURES", "image", "thrusters", "variable_map"]
