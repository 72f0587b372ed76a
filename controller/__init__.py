"""Region-reaching control: state, regions and weights in, forces out."""

from controller.errors import CompilationError, ControllerError, LawError, TranslationError
from controller.function_law import FunctionLaw, RegionsSeen
from controller.law import CompiledLaw, Law, VehicleModel, VehicleState
from controller.law_in_c import translate_law
from controller.laws import LAWS
from controller.laws.ismail_dunnigan import IsmailDunniganLaw
from controller.paper_law import Gains

__all__ = [
    "LAWS",
    "CompilationError",
    "CompiledLaw",
    "ControllerError",
    "FunctionLaw",
    "Gains",
    "IsmailDunniganLaw",
    "Law",
    "LawError",
    "RegionsSeen",
    "TranslationError",
    "VehicleModel",
    "VehicleState",
    "translate_law",
]
