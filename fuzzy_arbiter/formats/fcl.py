"""The Fuzzy Control Language of IEC 61131-7, as jFuzzyLogic reads it too."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

from fuzzy_arbiter.definition import WEIGHTED, Output, System, Variable, variable_names
from fuzzy_arbiter.engines.supported import bent
from fuzzy_arbiter.errors import UnsupportedError
from fuzzy_arbiter.formats.blocks import Block, RuleBlock, assemble, group_rules
from fuzzy_arbiter.formats.fcl_terms import format_shape, read_shape, universe_of
from fuzzy_arbiter.formats.fcl_tokens import RESERVED, chosen_block, cut, sections_of
from fuzzy_arbiter.formats.fll_terms import TYPES
from fuzzy_arbiter.formats.notation import format_number, located, read_number, refuse, require_words, unsupported_rule
from fuzzy_arbiter.formats.settings import format_settings, read_settings
from fuzzy_arbiter.formats.vocabulary import WORDS, operator_words, word_of
from fuzzy_arbiter.propositions import Is, quoted
from fuzzy_arbiter.rule import Operators, Rule, parse_rules
from fuzzy_arbiter.shapes import Shape
from fuzzy_arbiter.terms.term import Term
from fuzzy_arbiter.terms.values import Constant, Formula, Linear, Value

_WORDS = WORDS["fcl"]
_KEYS = {"AND": "conjunction", "OR": "disjunction", "ACT": "implication", "ACCU": "aggregation"}
# which the standard and jFuzzyLogic pair, where one alone is said
_PAIRS = {
    "min": "max",
    "prod": "probor",
    "bounded_difference": "bounded_sum",
    "drastic_product": "drastic_sum",
    "nilpotent_minimum": "nilpotent_maximum",
    "hamacher_product": "einstein_sum",
    "einstein_product": "einstein_sum",
}
_NAME = r"[A-Za-z_][A-Za-z0-9_]*"
_DECLARATION = re.compile(rf"({_NAME}(?: , {_NAME})*) : REAL", re.IGNORECASE)
_RANGE = re.compile(r"\( (\S+) \.\. (\S+) \)")


def read(text: str, block: str | None = None) -> System:
    """Parse a function block as a system."""
    # A variable without RANGE has the universe of its points. NC becomes a missing default. Missing statements have
    # jFuzzyLogic's defaults: ACT is MIN, ACCU is MAX, METHOD is COG; where fuzzylite wrote the text, values are added.
    tokens, comments = cut(text)
    (begin, *sections), fuzzylite = sections_of(chosen_block(tokens, block))
    for section in sections:
        section.word("ENABLED", {"TRUE": True}, "TRUE")
        if section.kind in ("FUZZIFY", "DEFUZZIFY"):
            fuzzylite |= section.kind == "FUZZIFY" and "RANGE" in section.entries
            fuzzylite |= any(term.split(" ")[1] in TYPES for _, term in section.many)
    fuzzylite |= any("generated with fuzzylite" in text for _, text in comments)
    rule_blocks = [section for section in sections if section.kind == "RULEBLOCK"]
    accumulations = {section.word("ACCU", _WORDS["aggregation"] | {"": ""}): section.line for section in rule_blocks}
    accumulations.pop("", None)
    if len(accumulations) > 1:
        refuse(max(accumulations.values()), "RULEBLOCK has another ACCU than that before it, expected the same")
    usual = {
        weighted: next(iter(accumulations), "sum" if weighted and fuzzylite else "max") for weighted in (False, True)
    }
    inputs = [_input(section) for section in _declared(sections, "VAR_INPUT", "FUZZIFY")]
    names = [v.name for v in inputs]
    outputs = [
        _output(section, names, usual) for section in _declared(sections, "VAR_OUTPUT", "DEFUZZIFY", taken=names)
    ]
    any_is_term = {term for v in inputs for term in v.term_names if term.lower() == "any"}
    blocks = [_rules(section, any_is_term) for section in rule_blocks]
    if not fuzzylite:
        blocks = [
            (norms, [(line, _on_first_of_value(rule, outputs)) for line, rule in rules]) for norms, rules in blocks
        ]
    return assemble(begin.line, inputs, outputs, blocks, name=begin.name or "arbiter", **read_settings(comments))


def _declared(sections: Sequence[Block], declaration: str, kind: str, taken: Collection[str] = ()) -> list[Block]:
    """Return the sections of the declared variables in their order, with the ranges of the declarations."""
    blocks: dict[str, Block] = {}
    for section in sections:
        if section.kind == kind and blocks.setdefault(section.name, section) is not section:
            refuse(section.line, f"{section.title} appears twice")
    declared: dict[str, int] = {}  # line by name
    names: list[str] = []
    for line, text in (entry for section in sections if section.kind == declaration for entry in section.many):
        match = _DECLARATION.fullmatch(text)
        if not match and not (names and text.upper().startswith("RANGE ")):
            refuse(line, f"{text!r}, expected a variable's name, a colon and REAL")
        names = match[1].split(" , ") if match else names
        for name in names:
            if not match and name in blocks:
                blocks[name].add(line, "RANGE", text[6:].removeprefix(":= "))
            if match and (name in declared or name in taken or name.lower() in RESERVED):
                fault = "a word of the language" if name.lower() in RESERVED else "declared twice"
                refuse(line, f"{name!r} is {fault}")
            declared.setdefault(name, line)
    for name, section in blocks.items():
        if name not in declared:
            refuse(section.line, f"{section.title}, expected one of {', '.join(declared) or 'none: none is declared'}")
    for name, line in declared.items():
        if name not in blocks:
            refuse(line, f"{name!r} has no {kind}")
    return [blocks[name] for name in declared]


def _terms(section: Block, inputs: Sequence[str] | None) -> tuple[tuple[Term, ...], list[float]]:
    """Return the terms of a variable, and their points."""
    terms, positions = [], []
    for line, text in section.many:
        name, _, content = text.partition(" ")
        if not re.fullmatch(_NAME, name) or name.lower() in RESERVED:
            refuse(line, f"TERM {name!r}, expected a term's name")
        with located(f"line {line}: term {name!r}"):
            shape, extent = read_shape(content, line, inputs)
            terms.append(Term(name, shape))
        positions += extent
    return tuple(terms), positions


def _input(section: Block) -> Variable:
    terms, positions = _terms(section, None)
    return section.build(Variable, section.name, _universe(section, positions), terms)


def _universe(section: Block, positions: Sequence[float], weighted: bool = False) -> tuple[float, float]:
    line, text = section.entry("RANGE")
    if text:
        limits = _RANGE.fullmatch(text)
        if not limits:
            refuse(line, f"RANGE of {section.title} is {text}, expected (minimum .. maximum)")
        low, high = limits.groups()
        return read_number(low, line, "the minimum"), read_number(high, line, "the maximum")
    universe = universe_of(positions)
    if universe is None and weighted:  # values do not depend on the universe
        return min(positions, default=0.0) - 1.0, max(positions, default=0.0) + 1.0
    expected = "expected RANGE := (minimum .. maximum);"
    return universe or refuse(section.line, f"{section.name!r} has no range, and its points make none; {expected}")


def _output(section: Block, inputs: Sequence[str], aggregations: dict[bool, str]) -> Output:
    """Return an output; these aggregations join its sets or values unless it has its own."""
    terms, positions = _terms(section, inputs)
    values = any(isinstance(term.shape, Constant | Linear) for term in terms)
    sets = any(not isinstance(term.shape, Value) for term in terms)
    usual = "average" if values and not sets else "centroid"  # the default of jFuzzyLogic
    method: Any = section.word("METHOD", {**_WORDS["defuzzifier"], "": usual})
    weighted = method in WEIGHTED
    own = section.word("ACCU", {**_WORDS["aggregation"], "": aggregations[weighted]})
    locks = set(section.entry("LOCK")[1].split(" | "))
    if not locks <= {"PREVIOUS", "RANGE", ""}:
        refuse(section.entry("LOCK")[0], f"LOCK is {section.entry('LOCK')[1]}, expected PREVIOUS, RANGE or both")
    # fuzzylite adds NC where the previous value is kept
    line, text = section.entry("DEFAULT", "NC")
    value, _, other = text.partition(" | ")
    default = None if value.upper() in ("NC", "NAN") else read_number(value, line, "the default, or NC,")
    if other.upper() not in ("", "NC"):
        refuse(line, f"DEFAULT of {section.title} is {text}, expected NC after |")
    universe, keeps = _universe(section, positions, weighted), "PREVIOUS" in locks or bool(other)
    return section.build(Output, section.name, universe, terms, default, method, own, "RANGE" in locks, keeps)


def _rules(section: Block, any_is_term: set[str]) -> RuleBlock:
    """Return the operators of a rule block, of which AND and OR imply each other, and its rules."""
    norms = {key: section.word(key, _WORDS[kind] | {"": ""}) for key, kind in _KEYS.items()}
    conjunction = norms["AND"] or next((a for a, b in _PAIRS.items() if b == norms["OR"]), "min")

    def parse(_: int, text: str) -> list[Rule]:
        # fuzzylite has a term *any* of every input, unless one has that name
        return parse_rules(" ".join(quoted(word) if word in any_is_term else word for word in text.split(" ")))

    return Operators(conjunction, norms["OR"] or _PAIRS[conjunction], norms["ACT"] or "min"), section.rules(parse)


def _on_first_of_value(rule: Rule, outputs: list[Output]) -> Rule:
    """Return a rule that concludes the first of terms of one value: jFuzzyLogic joins strengths by value."""
    first = {
        Is(output.name, term.name): Is(output.name, next(t.name for t in output.terms if t.shape == term.shape))
        for output in outputs
        if output.weighted and output.aggregation != "sum"
        for term in output.terms
    }
    return replace(rule, conclusions=tuple(first.get(c, c) for c in rule.conclusions))


def write(system: System) -> str:
    """Format a system as a function block."""
    require_words(system, "fcl", RESERVED, others=(system.name,))
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
        raise UnsupportedError(
            f"fcl cannot express the defuzzifier 'sum' of output {output.name!r}: expected 'average'"
        )
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
                raise UnsupportedError(
                    f"fcl cannot express the names {other!r} and {name!r}: they differ in case alone"
                )
