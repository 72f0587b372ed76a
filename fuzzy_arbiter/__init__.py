"""A fuzzy arbiter of prioritised criteria, which decides to what degree each one matters now.

`Arbiter` loads, saves, decides, explains and verifies. The modules `pictures`, `formats` (files as systems,
`fold_normalization`) and `export` (C and Python code) are there for those who ask for more.
"""

from fuzzy_arbiter.arbiter import Arbiter
from fuzzy_arbiter.definition import Output, System, Term, Variable
from fuzzy_arbiter.errors import ArbiterError, UndefinedOutputError
from fuzzy_arbiter.hierarchy import SECTION_VI, Criterion, prioritised
from fuzzy_arbiter.hysteresis import HysteresisArbiter
from fuzzy_arbiter.membership import ramp
from fuzzy_arbiter.rule import Rule
from fuzzy_arbiter.shapes import Shape, falling, rising, trapezoid, triangle

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
