"""The words of the FuzzyLite Language: keys of its blocks, operators and defuzzifiers."""

from __future__ import annotations

from collections.abc import Sequence

from fuzzy_arbiter.definition import Output
from fuzzy_arbiter.terms.norms import AGGREGATIONS, S_NORMS, T_NORMS

CONJUNCTIONS = {norm.fll: name for name, norm in T_NORMS.items()}  # also implications
DISJUNCTIONS = {norm.fll: name for name, norm in S_NORMS.items()}
JOINS = {norm.fll: name for name, norm in AGGREGATIONS.items()}
RESOLUTION = 1000  # fuzzylite's default for its defuzzifiers
DEFUZZIFIERS = {
    "Centroid": "centroid",
    "Bisector": "bisector",
    "MeanOfMaximum": "mom",
    "SmallestOfMaximum": "som",
    "LargestOfMaximum": "lom",
    "WeightedAverage": "average",
    "WeightedSum": "sum",
}

KEYS: dict[str, tuple[str, ...]] = {
    "Engine": ("description",),
    "InputVariable": ("description", "enabled", "range", "lock-range", "term"),
    "OutputVariable": (
        *("description", "enabled", "range", "lock-range", "term"),
        *("aggregation", "defuzzifier", "default", "lock-previous"),
    ),
    "RuleBlock": ("description", "enabled", "conjunction", "disjunction", "implication", "activation", "rule"),
}
MANY = ("term", "rule")  # keys that may repeat in one block
OLD = {"accumulation": "aggregation"}  # keys of fuzzylite 5


def settings_of(outputs: Sequence[Output]) -> tuple[str, ...]:
    """Return the settings of a system that the language cannot represent."""
    return ("normalization", "points") if all(output.weighted for output in outputs) else ("normalization",)
