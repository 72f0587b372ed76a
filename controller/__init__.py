"""Region-reaching control: state, regions and weights in, forces out."""

import warnings
from importlib import import_module

from controller.errors import ControllerError, LawError
from controller.function_law import FunctionLaw, RegionsSeen
from controller.law import CompiledLaw, Law, VehicleState
from controller.law_in_c import translate_law
from controller.laws import LAWS
from controller.laws.ismail_dunnigan import IsmailDunniganLaw
from controller.paper_law import Gains

__all__ = [
    "LAWS",
    "CompiledLaw",
    "ControllerError",
    "FunctionLaw",
    "Gains",
    "IsmailDunniganLaw",
    "Law",
    "LawError",
    "RegionsSeen",
    "VehicleState",
    "translate_law",
]

_FORMER = {"CompilationError": "errors", "TranslationError": "errors", "VehicleModel": "law"}  # no longer public


def __getattr__(name: str) -> object:
    if name not in _FORMER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = f"controller.{_FORMER[name]}"
    warnings.warn(f"controller.{name} is no longer public, but in {home}", DeprecationWarning, stacklevel=2)
    return getattr(import_module(home), name)
