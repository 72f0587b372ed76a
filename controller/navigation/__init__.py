"""Navigation: the vehicle's state from its sensors alone.

Imports: compiling.
"""

from controller.navigation.measurements import Measurements, SensorModel, empty_measurements
from controller.navigation.navigator import Navigator

__all__ = ["Measurements", "Navigator", "SensorModel", "empty_measurements"]
