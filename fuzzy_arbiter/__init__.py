"""Fuzzy systems of Mamdani, Sugeno and Tsukamoto: define, evaluate, explain, verify, tune, load and save them.

`Arbiter` evaluates a `System`. The modules `criteria` (prioritized criteria), `terms` (curves, values), `pictures`,
`formats` (files as systems, `fold_normalization`) and `export` (C and Python code) serve more detailed uses.
"""

import importlib
import warnings
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fuzzy_arbiter.arbiter import Arbiter
    from fuzzy_arbiter.definition import Output, System, Variable
    from fuzzy_arbiter.errors import ArbiterError
    from fuzzy_arbiter.result import Result
    from fuzzy_arbiter.rule import Operators, Rule
    from fuzzy_arbiter.shapes import Shape, falling, rising, trapezoid, triangle
    from fuzzy_arbiter.terms.curves import Curve, curve
    from fuzzy_arbiter.terms.term import Term, auto_terms
    from fuzzy_arbiter.terms.values import Constant, Formula, Linear
    from fuzzy_arbiter.tuning import Fit, fit

__all__ = [
    "Arbiter",
    "ArbiterError",
    "Constant",
    "Curve",
    "Fit",
    "Formula",
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
    "fit",
    "rising",
    "trapezoid",
    "triangle",
]

# modules of these names, imported on first use, so that the command can report a dependency that is not installed;
# each after those that it imports, so that a name is found before others are imported
_MODULES = (
    *("errors", "result", "shapes", "terms.curves", "terms.values", "terms.term"),
    *("rule", "definition", "arbiter", "tuning"),
)
_CRITERIA = ("SECTION_VI", "Criterion", "HysteresisArbiter", "prioritized", "ramp")  # which stood here before


def __getattr__(name: str) -> object:
    if name in (*_CRITERIA, "prioritised"):
        new = name.replace("ised", "ized")
        warnings.warn(f"fuzzy_arbiter.{name} is now fuzzy_arbiter.criteria.{new}", DeprecationWarning, stacklevel=2)
        return getattr(importlib.import_module(f"{__name__}.criteria"), new)
    for path in _MODULES if name in __all__ else ():
        module = importlib.import_module(f"{__name__}.{path}")
        if hasattr(module, name):
            return getattr(module, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
