"""The words of the FuzzyLite Language: keys of its blocks, and operators."""

from __future__ import annotations

SETTINGS = ("normalization",)
CONJUNCTIONS = {"Minimum": "min", "AlgebraicProduct": "prod"}  # and implications
DISJUNCTIONS = {"Maximum": "max", "AlgebraicSum": "probor"}
RESOLUTION = 1000  # of fuzzylite's Centroid, where none is said

KEYS: dict[str, tuple[str, ...]] = {
    "Engine": ("description",),
    "InputVariable": ("description", "enabled", "range", "lock-range", "term"),
    "OutputVariable": (
        *("description", "enabled", "range", "lock-range", "term"),
        *("aggregation", "defuzzifier", "default", "lock-previous"),
    ),
    "RuleBlock": ("description", "enabled", "conjunction", "disjunction", "implication", "activation", "rule"),
}
MANY = ("term", "rule")  # keys that may come again in one block
