"""The Fuzzy Control Language of IEC 61131-7, as jFuzzyLogic reads it too."""

from __future__ import annotations

import re

from fuzzy_arbiter.definition import Output, System, Variable, variable_names
from fuzzy_arbiter.engines.supported import bent
from fuzzy_arbiter.errors import UnsupportedError
from fuzzy_arbiter.formats.fcl_reader import read
from fuzzy_arbiter.formats.fcl_terms import format_shape, universe_of
from fuzzy_arbiter.formats.fcl_tokens import RESERVED
from fuzzy_arbiter.formats.notation import format_number, group_rules, require_word, require_words, unsupported_rule
from fuzzy_arbiter.formats.settings import format_settings
from fuzzy_arbiter.formats.vocabulary import operator_words, word_of
from fuzzy_arbiter.rule import Rule
from fuzzy_arbiter.shapes import Shape
from fuzzy_arbiter.terms.values import Formula, Linear

__all__ = ["read", "write"]


def write(system: System) -> str:
    """Format a system as a function block."""
    require_word(system.name, "fcl", RESERVED)
    require_words(system, "fcl", RESERVED)
    _require_one_case(system)
    lines = [f"(* {text} *)" for text in format_settings(system)]
    lines += [f"FUNCTION_BLOCK {system.name}", "", "VAR_INPUT"]
    names = variable_names(system.inputs)
    for v in system.inputs:
        # jFuzzyLogic's place for it; the standard has none for inputs
        points = [x for t in v.terms if isinstance(t.shape, Shape) for x, _ in t.shape.points]
        known = universe_of(points) == v.universe and all(isinstance(t.shape, Shape) for t in v.terms)
        lines.append(f"  {v.name} : REAL;" + ("" if known else f" {_format_range(v)}"))
    lines += ["END_VAR", "", "VAR_OUTPUT", *(f"  {v.name} : REAL;" for v in system.outputs), "END_VAR", ""]
    for v in (*system.inputs, *system.outputs):
        section = "DEFUZZIFY" if isinstance(v, Output) else "FUZZIFY"
        lines.append(f"{section} {v.name}")
        lines += [f"  TERM {term.name} := {format_shape(term.shape, term.name, names)};" for term in v.terms]
        lines += _format_output(v, system) if isinstance(v, Output) else []
        lines += [f"END_{section}", ""]
    accumulations = {word_of("fcl", "aggregation", o.aggregation) for o in system.outputs}
    for k, (operators, rules) in enumerate(group_rules(system)):
        lines.append(f"RULEBLOCK rules{k + 1 if k else ''}")
        words = zip(("AND", "OR", "ACT"), operator_words("fcl", operators), strict=True)
        lines += [f"  {key} : {word};" for key, word in words]
        lines += [f"  ACCU : {word};" for word in accumulations if len(accumulations) == 1]
        lines += [f"  RULE {i + 1} : {_format_rule(i, rule)};" for i, rule in rules]
        lines += ["END_RULEBLOCK", ""]
    return "\n".join([*lines, "END_FUNCTION_BLOCK", ""])


def _format_range(v: Variable) -> str:
    return f"RANGE := ({format_number(v.universe[0])} .. {format_number(v.universe[1])});"


def _format_output(output: Output, system: System) -> list[str]:
    method = word_of("fcl", "defuzzifier", output.defuzzifier)
    if method == "COGSS":
        raise UnsupportedError(f"fcl cannot say the defuzzifier 'sum' of output {output.name!r}: expected 'average'")
    if output.weighted and any(isinstance(term.shape, Formula | Linear) for term in output.terms):
        method = "COGF"
    lines = [f"  METHOD : {method};"]
    # an aggregation that is not that of all outputs is said here, as fuzzylite does
    if len({other.aggregation for other in system.outputs}) > 1:
        lines.append(f"  ACCU : {word_of('fcl', 'aggregation', output.aggregation)};")
    lines.append(f"  DEFAULT := {'NC' if output.default is None else format_number(output.default)};")
    locks = [word for word, on in (("PREVIOUS", output.lock_previous), ("RANGE", output.lock_range)) if on]
    return [*lines, *([f"  LOCK : {' | '.join(locks)};"] if locks else []), f"  {_format_range(output)}"]


def _format_rule(i: int, rule: Rule) -> str:
    if bent(rule.condition):
        raise unsupported_rule("fcl", i, rule, "no hedges")
    text = str(Rule(rule.condition, rule.conclusions[:1]))
    text = re.sub(r"\b(if|then|and|or|not|is)\b", lambda m: m[0].upper(), text)  # no name is one of these words
    text += "".join(f", {c.variable} IS {c.term}" for c in rule.conclusions[1:])
    return text if rule.weight == 1.0 else f"{text} WITH {format_number(rule.weight)}"


def _require_one_case(system: System) -> None:
    """Require that no two names differ only in the case of letters, which the standard ignores."""
    variables = (*system.inputs, *system.outputs)
    for names in (variable_names(variables), *(v.term_names for v in variables)):
        known: dict[str, str] = {}
        for name in names:
            other = known.setdefault(name.lower(), name)
            if other != name:
                raise UnsupportedError(f"fcl cannot say the names {other!r} and {name!r}: they differ in case alone")
