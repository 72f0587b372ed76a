"""FMUs stepped from Python: variables as arrays and by name, states, derivatives.

Imports: variables.
"""

from plant_fmu.running.channels import Channel, Channels
from plant_fmu.running.plant import Plant
from plant_fmu.running.state import State

__all__ = ["Channel", "Channels", "Plant", "State"]
