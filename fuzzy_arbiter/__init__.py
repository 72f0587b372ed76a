"""A fuzzy arbiter of prioritized criteria, which decides to what degree each one matters now.

`Arbiter` loads, saves, decides, explains and verifies. The modules `terms` (curves, values), `pictures`, `formats`
(files as systems, `fold_normalization`) and `export` (C and Python code) serve more detailed uses.
"""

import importlib
import warnings
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fuzzy_arbiter.arbiter import Arbiter
    from fuzzy_arbiter.definition import Output, System, Variable
    from fuzzy_arbiter.errors import ArbiterError
    from fuzzy_arbiter.hierarchy import SECTION_VI, Criterion, prioritized
    from fuzzy_arbiter.hysteresis import HysteresisArbiter
    from fuzzy_arbiter.membership import ramp
    from fuzzy_arbiter.result import Result
    from fuzzy_arbiter.rule import Operators, Rule
    from fuzzy_arbiter.shapes import Shape, falling, rising, trapezoid, triangle
    from fuzzy_arbiter.terms.curves import Curve, curve
    from fuzzy_arbiter.terms.term import Term, auto_terms
    from fuzzy_arbiter.terms.values import Constant, Formula, Linear

__all__ = [
    "SECTION_VI",
    "Arbiter",
    "ArbiterError",
    "Constant",
    "Criterion",
    "Curve",
    "Formula",
    "HysteresisArbiter",
    "Linear",
    "Operators",
    "Output",
    "Result",
    "Rule",
    "Shape",
    "System",
    "Term",
    "Variable",
    "auto_terms",
    "curve",
    "falling",
    "prioritized",
    "ramp",
    "rising",
    "trapezoid",
    "triangle",
]

# modules of these names, imported on first use, so that the command can report a dependency that is not installed;
# each after those that it imports, so that a name is found before others are imported
_MODULES = (
    *("membership", "errors", "result", "shapes", "terms.curves", "terms.values", "terms.term"),
    *("rule", "definition", "hierarchy", "arbiter", "hysteresis"),
)


def __getattr__(name: str) -> object:
    if name == "prioritised":  # its former spelling
        warnings.warn("fuzzy_arbiter.prioritised is now prioritized", DeprecationWarning, stacklevel=2)
        name = "prioritized"
    for path in _MODULES if name in __all__ else ():
        module = importlib.import_module(f"{__name__}.{path}")
        if hasattr(module, name):
            return getattr(module, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
