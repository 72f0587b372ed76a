"""Region-reaching control: state, regions and weights in, forces out."""

from controller.allocation import Allocation
from controller.errors import ControllerError, LawError, RegionError
from controller.function_law import FunctionLaw, RegionsSeen
from controller.law import CompiledLaw, Diagnostic, Law, VehicleModel, VehicleState, WrenchLaw
from controller.laws import LAWS, IsmailDunniganLaw
from controller.paper_law import Gains

__all__ = [
    "LAWS",
    "Allocation",
    "CompiledLaw",
    "ControllerError",
    "Diagnostic",
    "FunctionLaw",
    "Gains",
    "IsmailDunniganLaw",
    "Law",
    "LawError",
    "RegionError",
    "RegionsSeen",
    "VehicleModel",
    "VehicleState",
    "WrenchLaw",
]
