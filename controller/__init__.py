"""Region-reaching control: state, regions and weights in, forces out."""

from controller.allocation import Allocation
from controller.errors import ControllerError, LawError, RegionError
from controller.law import Law, PrintedLaw, RegionValues, VehicleState
from controller.printed_law import Gains

__all__ = [
    "Allocation",
    "ControllerError",
    "Gains",
    "Law",
    "LawError",
    "PrintedLaw",
    "RegionError",
    "RegionValues",
    "VehicleState",
]
