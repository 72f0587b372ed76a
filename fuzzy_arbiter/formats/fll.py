"""The FuzzyLite Language, as pyfuzzylite and fuzzylite read and write it."""

from __future__ import annotations

from fuzzy_arbiter.definition import Output, System
from fuzzy_arbiter.errors import UnsupportedError
from fuzzy_arbiter.formats.fll_reader import read
from fuzzy_arbiter.formats.fll_terms import RESERVED, format_shape
from fuzzy_arbiter.formats.notation import (
    blocks,
    format_number,
    format_numbers,
    require_words,
    unsupported_rule,
)
from fuzzy_arbiter.formats.settings import format_settings, settings_of
from fuzzy_arbiter.formats.vocabulary import operator_words, word_of
from fuzzy_arbiter.propositions import And, Anything, Hedged, Is, Not, Or, Proposition
from fuzzy_arbiter.rule import Rule
from fuzzy_arbiter.terms.norms import HEDGES

__all__ = ["read", "write"]


def write(system: System) -> str:
    """Format a system in the FuzzyLite Language."""
    if "#" in system.name:
        raise UnsupportedError(f"fll cannot say the name {system.name!r}: what follows # is a comment")
    require_words(system, "fll", RESERVED)
    lines = [f"# {text}" for text in format_settings(system, settings_of(system.outputs))]
    lines.append(f"Engine: {system.name}")
    for v in (*system.inputs, *system.outputs):
        locked = v.lock_range if isinstance(v, Output) else system.outside == "clip"
        lines += [f"{'Output' if isinstance(v, Output) else 'Input'}Variable: {v.name}", "  enabled: true"]
        lines += [f"  range: {format_numbers(v.universe)}", f"  lock-range: {str(locked).lower()}"]
        if isinstance(v, Output):
            method = "Automatic" if v.weighted else system.points
            lines += [f"  aggregation: {word_of('fll', 'aggregation', v.aggregation)}"]
            lines += [f"  defuzzifier: {word_of('fll', 'defuzzifier', v.defuzzifier)} {method}"]
            lines += [f"  default: {'nan' if v.default is None else format_number(v.default)}"]
            lines += [f"  lock-previous: {str(v.lock_previous).lower()}"]
        lines += [f"  term: {term.name} {format_shape(term.shape)}" for term in v.terms]
    for k, (operators, rules) in enumerate(blocks(system)):
        lines += [f"RuleBlock: rules{k + 1 if k else ''}", "  enabled: true"]
        keys = ("conjunction", "disjunction", "implication")
        lines += [f"  {key}: {word}" for key, word in zip(keys, operator_words("fll", operators), strict=True)]
        lines += ["  activation: General", *(f"  rule: {_rule(i, rule)}" for i, rule in rules)]
    return "\n".join([*lines, ""])


def _rule(i: int, rule: Rule) -> str:
    conclusions = " and ".join(map(str, rule.conclusions))
    weight = "" if rule.weight == 1.0 else f" with {format_number(rule.weight)}"
    return f"if {_condition(rule.condition, i, rule)} then {conclusions}{weight}"


def _condition(p: Proposition, i: int, rule: Rule) -> str:
    if isinstance(p, And | Or):
        word = " and " if isinstance(p, And) else " or "
        texts = ((part, _condition(part, i, rule)) for part in p.parts)
        return word.join(f"({text})" if isinstance(part, And | Or) else text for part, text in texts)
    bends: list[str] = []
    while isinstance(p, Not | Hedged):
        if isinstance(p, Hedged) and not HEDGES[p.hedge].fll:
            raise unsupported_rule("fll", i, rule, "a hedge of fuzzylite's, such as very, somewhat or extremely")
        bends.append(p.hedge if isinstance(p, Hedged) else "not")
        p = p.part
    if not isinstance(p, Is | Anything):
        raise unsupported_rule("fll", i, rule, "only terms negated")
    return f"{p.variable} is {' '.join([*bends, p.term if isinstance(p, Is) else 'any'])}"
