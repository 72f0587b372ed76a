"""The FuzzyLite Language, as pyfuzzylite and fuzzylite read and write it."""

from __future__ import annotations

from fuzzy_arbiter.definition import Output, System, Variable
from fuzzy_arbiter.errors import UnsupportedError
from fuzzy_arbiter.formats.fll_reader import read
from fuzzy_arbiter.formats.fll_terms import RESERVED, format_shape
from fuzzy_arbiter.formats.fll_words import DEFUZZIFIERS, settings_of
from fuzzy_arbiter.formats.notation import (
    blocks,
    format_number,
    format_numbers,
    require_words,
    unsupported_rule,
    word_of,
)
from fuzzy_arbiter.formats.settings import format_settings
from fuzzy_arbiter.propositions import And, Anything, Hedged, Is, Not, Or, Proposition
from fuzzy_arbiter.rule import Rule
from fuzzy_arbiter.terms.norms import AGGREGATIONS, HEDGES, S_NORMS, T_NORMS

__all__ = ["read", "write"]


def write(system: System) -> str:
    """Format a system in the FuzzyLite Language."""
    if "#" in system.name:
        raise UnsupportedError(f"fll cannot say the name {system.name!r}: what follows # is a comment")
    require_words(system, "fll", RESERVED)
    lock = "true" if system.outside == "clip" else "false"
    lines = [f"# {text}" for text in format_settings(system, settings_of(system.outputs))]
    lines.append(f"Engine: {system.name}")
    for v in system.inputs:
        lines += [f"InputVariable: {v.name}", "  enabled: true", f"  range: {format_numbers(v.universe)}"]
        lines += [f"  lock-range: {lock}", *_terms(v)]
    for output in system.outputs:
        lines += [f"OutputVariable: {output.name}", "  enabled: true", f"  range: {format_numbers(output.universe)}"]
        lines += [f"  lock-range: {str(output.lock_range).lower()}"]
        lines += [f"  aggregation: {word_of('fll', 'aggregation', output.aggregation, AGGREGATIONS)}"]
        lines += [f"  defuzzifier: {_defuzzifier(output, system)}"]
        lines += [f"  default: {'nan' if output.default is None else format_number(output.default)}"]
        lines += [f"  lock-previous: {str(output.lock_previous).lower()}", *_terms(output)]
    for k, (operators, rules) in enumerate(blocks(system)):
        lines += [f"RuleBlock: rules{k + 1 if k else ''}", "  enabled: true"]
        lines += [f"  conjunction: {word_of('fll', 'conjunction', operators.conjunction, T_NORMS)}"]
        lines += [f"  disjunction: {word_of('fll', 'disjunction', operators.disjunction, S_NORMS)}"]
        lines += [f"  implication: {word_of('fll', 'implication', operators.implication, T_NORMS)}"]
        lines += ["  activation: General"]
        lines += [f"  rule: {_rule(i, rule)}" for i, rule in rules]
    return "\n".join([*lines, ""])


def _defuzzifier(output: Output, system: System) -> str:
    word = next(word for word, name in DEFUZZIFIERS.items() if name == output.defuzzifier)
    return f"{word} Automatic" if output.weighted else f"{word} {system.points}"


def _terms(v: Variable) -> list[str]:
    return [f"  term: {term.name} {format_shape(term.shape)}" for term in v.terms]


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
