"""The words of MATLAB's text, with those that Octave and fuzzylite add: keys, operators, defuzzifiers and functions."""

from __future__ import annotations

from fuzzy_arbiter.shapes import falling, rising
from fuzzy_arbiter.terms.kinds import KINDS
from fuzzy_arbiter.terms.norms import AGGREGATIONS, S_NORMS, T_NORMS

SETTINGS = ("normalization", "outside", "points")

TYPES = ("mamdani", "sugeno", "tsukamoto", "hybrid")  # the last two are fuzzylite's
# Octave's words where MATLAB has others; fuzzylite leaves empty what no rule needs
T_WORDS = {**{norm.fis: name for name, norm in T_NORMS.items()}, "algebraic_product": "prod", "": "min"}
S_WORDS = {**{norm.fis: name for name, norm in S_NORMS.items()}, "algebraic_sum": "probor", "": "max"}
JOINS = {**{norm.fis: name for name, norm in AGGREGATIONS.items()}, "algebraic_sum": "probor", "": "max"}
DEFUZZIFIERS = {
    "centroid": "centroid",
    "centroid_integral": "centroid",  # Octave's, whose centroid sums at places
    "bisector": "bisector",
    "mom": "mom",
    "som": "som",
    "lom": "lom",
    "wtaver": "average",
    "wtsum": "sum",
}
METHODS = {"AndMethod": T_WORDS, "OrMethod": S_WORDS, "ImpMethod": T_WORDS, "AggMethod": JOINS}

# straight functions: their type in fuzzylite, and their number of parameters
STRAIGHT = {
    "trimf": ("Triangle", 3),
    "trapmf": ("Trapezoid", 4),
    "rampmf": ("Ramp", 2),
    "rectmf": ("Rectangle", 2),
    "binarymf": ("Binary", 2),
    "discretemf": ("Discrete", 0),
}
MATLAB = ("gaussmf", "gauss2mf", "gbellmf", "sigmf", "dsigmf", "psigmf", "zmf", "smf", "pimf")  # MATLAB has them too
CURVES = {kind.fis[0]: (name, kind.fis[1]) for name, kind in KINDS.items() if kind.fis[0]}
VALUES = ("constant", "linear", "function")
SHOULDERS = {"linsmf": rising, "linzmf": falling}
FUNCTIONS = (*STRAIGHT, *SHOULDERS, *CURVES, *VALUES)
# keys of a variable that fuzzylite's versions 3 to 5 add
FUZZYLITE_KEYS = ("Enabled", "Default", "LockRange", "LockPrevious")
# digits after the point of a term's number, as Octave writes hedges: ten times that is the power
OCTAVE_HEDGES: dict[str, tuple[str, ...]] = {
    "": (),
    "05": ("somewhat",),
    "2": ("very",),
    "3": ("cubed",),
    "4": ("very", "very"),
}
# and where a rule concludes a value, whose strength it takes to the inverse of that power
OCTAVE_ROOTS: dict[str, tuple[str, ...]] = {
    "": (),
    "05": ("very",),
    "2": ("somewhat",),
    "3": ("cube_root",),
    "4": ("somewhat", "somewhat"),
}
HEDGES: dict[str, tuple[str, ...]] = {
    "": (),
    "01": ("seldom",),
    "05": ("somewhat",),
    "2": ("very",),
    "3": ("extremely",),
    "4": ("very", "very"),
    "99": ("any",),
}
"""And as fuzzylite does, whose *extremely* is another."""
