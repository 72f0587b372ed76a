"""A fuzzy arbiter of prioritised criteria, which decides to what degree each one matters now.

`Arbiter` loads, saves, decides, explains and verifies. The modules `terms` (curves, values), `pictures`, `formats`
(files as systems, `fold_normalization`) and `export` (C and Python code) are there for those who ask for more.
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fuzzy_arbiter.arbiter import Arbiter
    from fuzzy_arbiter.definition import Output, System, Variable
    from fuzzy_arbiter.errors import ArbiterError, UndefinedOutputError
    from fuzzy_arbiter.hierarchy import SECTION_VI, Criterion, prioritised
    from fuzzy_arbiter.hysteresis import HysteresisArbiter
    from fuzzy_arbiter.membership import ramp
    from fuzzy_arbiter.rule import Rule
    from fuzzy_arbiter.shapes import Shape, falling, rising, trapezoid, triangle
    from fuzzy_arbiter.terms.term import Term

__all__ = [
    "SECTION_VI",
    "Arbiter",
    "ArbiterError",
    "Criterion",
    "HysteresisArbiter",
    "Output",
    "Rule",
    "Shape",
    "System",
    "Term",
    "UndefinedOutputError",
    "Variable",
    "falling",
    "prioritised",
    "ramp",
    "rising",
    "trapezoid",
    "triangle",
]

# imported when asked for, so that the command can say what is not installed
_HOMES = {
    "arbiter": {"Arbiter"},
    "definition": {"Output", "System", "Variable"},
    "errors": {"ArbiterError", "UndefinedOutputError"},
    "hierarchy": {"SECTION_VI", "Criterion", "prioritised"},
    "hysteresis": {"HysteresisArbiter"},
    "membership": {"ramp"},
    "rule": {"Rule"},
    "terms.term": {"Term"},
    "shapes": {"Shape", "falling", "rising", "trapezoid", "triangle"},
}


def __getattr__(name: str) -> object:
    for home, names in _HOMES.items():
        if name in names:
            return getattr(importlib.import_module(f"{__name__}.{home}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
