"""The words of FLL, FIS and FCL for operators and defuzzifiers, one table to read and to write each format."""

from __future__ import annotations

from fuzzy_arbiter.definition import System
from fuzzy_arbiter.rule import Operators
from fuzzy_arbiter.terms.norms import AGGREGATIONS, S_NORMS, T_NORMS

_NORMS = {"conjunction": T_NORMS, "disjunction": S_NORMS, "implication": T_NORMS, "aggregation": AGGREGATIONS}
# names of defuzzifiers, and the word of each format
_DEFUZZIFIERS = {
    "centroid": {"fll": "Centroid", "fis": "centroid", "fcl": "COG"},
    "bisector": {"fll": "Bisector", "fis": "bisector", "fcl": "COA"},
    "mom": {"fll": "MeanOfMaximum", "fis": "mom", "fcl": "MM"},
    "som": {"fll": "SmallestOfMaximum", "fis": "som", "fcl": "LM"},
    "lom": {"fll": "LargestOfMaximum", "fis": "lom", "fcl": "RM"},
    "average": {"fll": "WeightedAverage", "fis": "wtaver", "fcl": "COGS"},
    "sum": {"fll": "WeightedSum", "fis": "wtsum", "fcl": "COGSS"},
}
# further words that are read: Octave's in FIS, where fuzzylite leaves empty what no rule needs, and fuzzylite's in FCL
_T_WORDS = {
    "fll": {},
    "fis": {"algebraic_product": "prod", "": "min"},
    "fcl": {"DPROD": "drastic_product", "HPROD": "hamacher_product", "NMIN": "nilpotent_minimum"},
}
_S_WORDS = {
    "fll": {},
    "fis": {"algebraic_sum": "probor", "": "max"},
    "fcl": {"DSUM": "drastic_sum", "ESUM": "einstein_sum", "NMAX": "nilpotent_maximum", "PROBOR": "probor"},
}
_OTHER_DEFUZZIFIERS = {"fll": {}, "fis": {"centroid_integral": "centroid"}, "fcl": {"COGF": "average"}}

# by format and kind of word: the name that each word means
WORDS: dict[str, dict[str, dict[str, str]]] = {
    format: {
        **{
            kind: {name if format == "fis" else getattr(norm, format): name for name, norm in norms.items()}
            | (_T_WORDS if norms is T_NORMS else _S_WORDS)[format]
            for kind, norms in _NORMS.items()
        },
        "defuzzifier": {words[format]: name for name, words in _DEFUZZIFIERS.items()} | _OTHER_DEFUZZIFIERS[format],
    }
    for format in ("fll", "fis", "fcl")
}


def word_of(format: str, kind: str, name: str) -> str:
    """Return a format's word for an operator or a defuzzifier."""
    return next(word for word, known in WORDS[format][kind].items() if known == name)


def operator_words(format: str, operators: Operators | System) -> list[str]:
    """Return a format's words for the conjunction, the disjunction and the implication of a block of rules."""
    kinds = ("conjunction", "disjunction", "implication")
    return [word_of(format, kind, getattr(operators, kind)) for kind in kinds]
