"""The words of MATLAB's text: keys, operators and membership functions."""

from __future__ import annotations

from collections.abc import Callable

from fuzzy_arbiter.shapes import Shape, falling, rising, trapezoid, triangle

SETTINGS = ("normalization", "outside", "points")

# what a key may say, and what it means; algebraic_... are Octave's words, and fuzzylite leaves empty what no rule needs
METHODS: dict[str, dict[str, str]] = {
    "Type": {"mamdani": ""},
    "AndMethod": {"min": "min", "prod": "prod", "algebraic_product": "prod", "": "min"},
    "OrMethod": {"max": "max", "probor": "probor", "algebraic_sum": "probor", "": "max"},
    "ImpMethod": {"min": "min", "prod": "prod", "algebraic_product": "prod"},
    "AggMethod": {"max": ""},
    "DefuzzMethod": {"centroid": ""},
}

FUNCTIONS: dict[str, tuple[int, Callable[..., Shape]]] = {  # number of places, and what they make
    "trimf": (3, triangle),
    "trapmf": (4, trapezoid),
    "linsmf": (2, rising),
    "linzmf": (2, falling),
}
