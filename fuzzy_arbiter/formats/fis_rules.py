"""Read the rows of rules in MATLAB's text, with the hedges of Octave and fuzzylite."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from fuzzy_arbiter.definition import Output, Variable
from fuzzy_arbiter.formats.fis_terms import complement
from fuzzy_arbiter.formats.notation import located, read_number, refuse
from fuzzy_arbiter.propositions import And, Anything, Is, Not, Or, Proposition, bend
from fuzzy_arbiter.rule import Rule, bent_rules
from fuzzy_arbiter.terms.term import Term

# digits after the point of a term's number: fuzzylite's, Octave's in conditions, of which ten times is the power, and
# Octave's where a rule concludes a value, whose strength it takes to the inverse of that power
_Words = dict[str, tuple[str, ...]]
_COMMON: _Words = {"": (), "05": ("somewhat",), "2": ("very",), "4": ("very", "very")}
_FUZZYLITE: _Words = {**_COMMON, "01": ("seldom",), "3": ("extremely",), "99": ("any",)}
_OCTAVE: _Words = {**_COMMON, "3": ("cubed",)}
_ROOTS: _Words = {"": (), "05": ("very",), "2": ("somewhat",), "3": ("cube_root",), "4": ("somewhat", "somewhat")}
_RULE = re.compile(r"([^,()]*),([^,()]*)\(([^()]*)\)\s*:\s*(\S+)")


def read_rules(
    line: int, row: str, inputs: Sequence[Variable], outputs: Sequence[Output], fuzzylite: bool
) -> list[Rule]:
    """Parse a row of [Rules]."""
    match = _RULE.fullmatch(row)
    if not match:
        refuse(line, f"{row!r}, expected a rule such as 1 -2, 1 (1) : 1")
    condition_text, concluded, weight, connective = match.groups()
    if connective not in ("1", "2"):
        refuse(line, f"{row!r} ends in {connective!r}, expected 1 for and, 2 for or")
    condition: list[Proposition] = []
    words = _FUZZYLITE if fuzzylite else _OCTAVE
    for (index, negated, hedges), v in zip(_indices(condition_text, line, row, inputs, words), inputs, strict=True):
        statement = _statement(index, hedges, v)
        if statement is not None:
            condition.append(Not(statement) if negated else statement)
    conclusions: list[tuple[tuple[str, ...], Is]] = []
    words = _FUZZYLITE if fuzzylite else _ROOTS
    for (index, negated, hedges), v in zip(_indices(concluded, line, row, outputs, words), outputs, strict=True):
        if negated and (fuzzylite or v.weighted):
            refuse(line, f"{row!r} concludes that {v.name!r} is not in a term, expected a set of MATLAB's or Octave's")
        if hedges and not (fuzzylite or v.weighted):
            refuse(line, f"{row!r} has a hedge in the conclusion on {v.name!r}, expected none on a set")
        if index:
            term = v.terms[index - 1].name
            conclusions.append((hedges, Is(v.name, _not(term, v) if negated else term)))
    if not condition or not conclusions:
        refuse(line, f"{row!r} has no {'conclusion' if condition else 'condition'}, expected one number that is not 0")
    joined = condition[0] if len(condition) == 1 else (And if connective == "1" else Or)(tuple(condition))
    factor = read_number(weight.strip(), line, "weight")
    if factor != 1.0 and any(hedges for hedges, _ in conclusions):
        refuse(line, f"{row!r} has a hedge in a conclusion and a weight, expected the weight 1")
    return bent_rules(joined, conclusions, factor, carry=fuzzylite)


def _statement(index: int, hedges: tuple[str, ...], v: Variable) -> Proposition | None:
    if hedges == ("any",):
        return Anything(v.name)
    if not index:
        return None
    return bend(hedges, Is(v.name, v.terms[index - 1].name))


def _indices(
    text: str, line: int, row: str, variables: Sequence[Variable], words: _Words
) -> list[tuple[int, bool, tuple[str, ...]]]:
    """Return of each variable the number of its term from 1, whether it is negated, and its hedges."""
    parts = text.split()
    if len(parts) != len(variables):
        refuse(line, f"{row!r} has {len(parts)} numbers in {text.strip()!r}, expected {len(variables)}")
    indices = []
    for part, v in zip(parts, variables, strict=True):
        whole = re.fullmatch(r"(-?)([0-9]{1,9})(?:\.([0-9]*?)0*)?", part, re.ASCII)  # fuzzylite writes 1.000
        index = int(whole[2]) if whole else -1
        hedges = words.get(whole[3] or "") if whole else None
        if whole is None or index > len(v.terms) or hedges is None or (hedges and not index and hedges != ("any",)):
            expected = f"a whole number from {-len(v.terms)} to {len(v.terms)}, or .05, .2, .3 or .4 more for a hedge"
            refuse(line, f"{row!r}: {part} for {v.name!r}, expected {expected}")
        indices.append((index, whole[1] == "-", hedges))
    return indices


def with_complements(output: Output, rules: Sequence[tuple[int, Rule]]) -> Output:
    """Return an output with the complement of each term that a rule concludes negated."""
    added: dict[str, Term] = {}
    for line, rule in rules:
        for c in rule.conclusions:
            if c.variable == output.name and c.term not in (*output.term_names, *added):
                term = next(term for term in output.terms if _not(term.name, output) == c.term)
                with located(f"line {line}: not {term.name!r}"):
                    added[c.term] = Term(c.term, complement(term.membership))
    return replace(output, terms=(*output.terms, *added.values())) if added else output


def _not(term: str, output: Variable) -> str:
    name = f"not_{term}"
    while name in output.term_names:
        name += "_"
    return name
