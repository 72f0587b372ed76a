"""The Fuzzy Control Language of IEC 61131-7, as jFuzzyLogic reads it too."""

from __future__ import annotations

import re

from fuzzy_arbiter.definition import System, Variable, variable_names
from fuzzy_arbiter.errors import UnsupportedError
from fuzzy_arbiter.formats.fcl_reader import system_of, universe_of
from fuzzy_arbiter.formats.fcl_words import CONJUNCTIONS, DISJUNCTIONS, PAIRS, RESERVED, cut
from fuzzy_arbiter.formats.notation import require_word, require_words, say_number
from fuzzy_arbiter.formats.settings import read_settings, say_settings
from fuzzy_arbiter.rule import Rule
from fuzzy_arbiter.shapes import Shape

_SETTINGS = ("normalization", "outside", "points")


def write(system: System) -> str:
    """Return a system as a function block.

    Parameters
    ----------
    system : System
        Any that the language can say.

    Returns
    -------
    str
        Text of a file; settings that the language has no words for stand in a comment.

    Raises
    ------
    UnsupportedError
        If a name is no word of the language, or *and* and *or* are no pair of the standard.
    """
    require_word(system.name, "fcl", RESERVED)
    require_words(system, "fcl", RESERVED)
    _require_one_case(system)
    if PAIRS[system.conjunction] != system.disjunction:
        raise UnsupportedError(
            f"fcl cannot say the conjunction {system.conjunction!r} with the disjunction {system.disjunction!r}: "
            "expected 'min' with 'max', or 'prod' with 'probor'"
        )
    lines = [f"(* {text} *)" for text in say_settings(system, _SETTINGS)]
    lines += [f"FUNCTION_BLOCK {system.name}", "", "VAR_INPUT"]
    for v in system.inputs:
        # jFuzzyLogic's place for it; the standard has none for inputs
        known = universe_of([x for t in v.terms for x, _ in t.shape.points]) == v.universe
        lines.append(f"  {v.name} : REAL;" + ("" if known else f" {_say_range(v)}"))
    lines += ["END_VAR", "", "VAR_OUTPUT", *(f"  {v.name} : REAL;" for v in system.outputs), "END_VAR", ""]
    for v in system.inputs:
        lines += [f"FUZZIFY {v.name}", *_say_terms(v), "END_FUZZIFY", ""]
    for output in system.outputs:
        default = "NC" if output.default is None else say_number(output.default)
        lines += [f"DEFUZZIFY {output.name}", *_say_terms(output), "  METHOD : COG;", f"  DEFAULT := {default};"]
        lines += [f"  {_say_range(output)}", "END_DEFUZZIFY", ""]
    lines += ["RULEBLOCK rules", f"  AND : {_said(CONJUNCTIONS, system.conjunction)};"]
    lines += [f"  OR : {_said(DISJUNCTIONS, system.disjunction)};"]
    lines += [f"  ACT : {_said(CONJUNCTIONS, system.implication)};", "  ACCU : MAX;"]
    lines += [f"  RULE {i + 1} : {_say_rule(rule)};" for i, rule in enumerate(system.rules)]
    return "\n".join([*lines, "END_RULEBLOCK", "", "END_FUNCTION_BLOCK", ""])


def _said(words: dict[str, str], value: str) -> str:
    return next(word for word, said in words.items() if said == value)


def _say_range(v: Variable) -> str:
    return f"RANGE := ({say_number(v.universe[0])} .. {say_number(v.universe[1])});"


def _say_terms(v: Variable) -> list[str]:
    def points(shape: Shape) -> str:
        return " ".join(f"({say_number(x)}, {say_number(degree)})" for x, degree in shape.points)

    return [f"  TERM {term.name} := {points(term.shape)};" for term in v.terms]


def _say_rule(rule: Rule) -> str:
    text = str(Rule(rule.condition, rule.conclusions[:1]))
    text = re.sub(r"\b(if|then|and|or|not|is)\b", lambda m: m[0].upper(), text)  # no name is one of these words
    text += "".join(f", {c.variable} IS {c.term}" for c in rule.conclusions[1:])
    return text if rule.weight == 1.0 else f"{text} WITH {say_number(rule.weight)}"


def _require_one_case(system: System) -> None:
    """Refuse names that the standard, to which the case of letters means nothing, takes for the same."""
    variables = (*system.inputs, *system.outputs)
    for names in (variable_names(variables), *(v.term_names for v in variables)):
        known: dict[str, str] = {}
        for name in names:
            other = known.setdefault(name.lower(), name)
            if other != name:
                raise UnsupportedError(f"fcl cannot say the names {other!r} and {name!r}: they differ in case alone")


def read(text: str) -> System:
    """Return the system that a function block defines.

    A variable without RANGE has the universe of its points. NC becomes a missing default.

    Parameters
    ----------
    text : str
        One function block.

    Returns
    -------
    System
        Mamdani, with the centroid.

    Raises
    ------
    FormatError
        If the text is no FCL, or says what this package does not know; the line is named.
    DefinitionError
        If what it defines cannot be.
    """
    tokens, comments = cut(text)
    return system_of(tokens, read_settings(comments, _SETTINGS))
