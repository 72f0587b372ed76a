"""Reads the FuzzyLite Language."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from fuzzy_arbiter.definition import Output, System, Term, Variable
from fuzzy_arbiter.errors import FormatError
from fuzzy_arbiter.formats.fll_terms import HEDGES, read_shape
from fuzzy_arbiter.formats.fll_words import CONJUNCTIONS, DISJUNCTIONS, KEYS, MANY, RESOLUTION, SETTINGS
from fuzzy_arbiter.formats.notation import assembled, located, read_number, refuse
from fuzzy_arbiter.formats.settings import read_settings
from fuzzy_arbiter.propositions import And, Not, Or, Proposition
from fuzzy_arbiter.rule import Rule
from fuzzy_arbiter.rule_text import parse_rule


@dataclass
class _Block:
    """The lines of one engine, variable or rule block."""

    kind: str
    name: str
    line: int
    entries: dict[str, tuple[int, str]] = field(default_factory=dict)
    many: list[tuple[int, str]] = field(default_factory=list)

    def word(self, key: str, known: dict[str, Any], missing: str = "") -> Any:
        """Return what a key's word means."""
        line, value = self.entries.get(key, (self.line, missing))
        if value not in known:
            expected = " or ".join(word for word in known if word)
            refuse(line, f"{key} of {self.name!r} is {value or 'missing'}, expected {expected}")
        return known[value]

    def require_enabled(self) -> None:
        self.word("enabled", {"true": None}, "true")


def read(text: str) -> System:
    """Return the system that a text in the FuzzyLite Language defines.

    The points are those of the centroid; an output's default of ``nan`` is none; ranges that are locked clip inputs.

    Parameters
    ----------
    text : str
        One engine.

    Returns
    -------
    System
        Mamdani, with the centroid.

    Raises
    ------
    FormatError
        If the text is not of this language, or says what this package does not know; the line is named.
    DefinitionError
        If what it defines cannot be.
    """
    blocks, comments = _blocks(text)
    settings = read_settings(comments, SETTINGS)
    engines = [b for b in blocks if b.kind == "Engine"]
    if len(engines) != 1:
        raise FormatError(f"expected one Engine in a FLL file, {len(engines) or 'none'} came")
    inputs = [b for b in blocks if b.kind == "InputVariable"]
    outputs = [b for b in blocks if b.kind == "OutputVariable"]
    rule_blocks = [b for b in blocks if b.kind == "RuleBlock"]
    variables = [_variable(b) for b in inputs]
    results = [_output(b) for b in outputs]
    clips = _alike(inputs, [b.word("lock-range", {"true": "clip", "false": "refuse"}, "false") for b in inputs])
    points = _alike(outputs, [_resolution(b) for b in outputs])
    rules: list[tuple[int, Rule]] = []
    norms = None
    for block in rule_blocks:
        found = _rules(block)
        said = _norms(block, found)
        if norms not in (None, said):
            refuse(block.line, f"RuleBlock {block.name!r} has other operators than that before it, expected the same")
        norms = said
        rules += found
    name = engines[0].name or "arbiter"
    options = {"outside": clips or "refuse", "points": points or RESOLUTION, **(norms or {}), **settings}
    return assembled(engines[0].line, variables, results, rules, name=name, **options)


def _blocks(text: str) -> tuple[list[_Block], list[tuple[int, str]]]:
    blocks: list[_Block] = []
    comments: list[tuple[int, str]] = []
    for line, raw in enumerate(text.split("\n"), 1):
        content, sign, comment = raw.partition("#")
        if sign:
            comments.append((line, comment))
        if not content.strip():
            continue
        key, colon, value = (part.strip() for part in content.partition(":"))
        if not colon:
            refuse(line, f"{content.strip()!r}, expected a key, a colon and its value")
        if key in KEYS:
            blocks.append(_Block(key, value, line))
            continue
        if not blocks:
            refuse(line, f"{key!r} came, expected Engine first")
        block = blocks[-1]
        if key not in KEYS[block.kind]:
            refuse(line, f"{key!r} is not known in {block.kind}, expected one of {', '.join(KEYS[block.kind])}")
        if key in MANY:
            block.many.append((line, value))
        elif key in block.entries:
            refuse(line, f"{key} came twice in {block.kind} {block.name!r}")
        else:
            block.entries[key] = line, value
    return blocks, comments


def _alike(blocks: Sequence[_Block], values: Sequence[Any]) -> Any:
    """Return what all variables say; None if there are none."""
    for block, value in zip(blocks, values, strict=True):
        if value != values[0]:
            key = "lock-range" if block.kind == "InputVariable" else "defuzzifier"
            refuse(block.line, f"{block.name!r} has another {key} than {blocks[0].name!r}, expected the same for all")
    return values[0] if values else None


def _variable(block: _Block) -> Variable:
    block.require_enabled()
    line, value = block.entries.get("range", (block.line, ""))
    bounds = [read_number(part, line, "range") for part in value.split()]
    if len(bounds) != 2:
        refuse(line, f"range of {block.name!r} is {value or 'missing'}, expected two numbers")
    terms: list[Term] = []
    for line, content in block.many:
        name, kind, numbers = (*content.split(maxsplit=2), "", "", "")[:3]
        with located(f"line {line}: term {name!r}"):
            terms.append(Term(name, read_shape(kind, numbers, line)))
    with located(f"line {block.line}"):
        return Variable(block.name, (bounds[0], bounds[1]), tuple(terms))


def _output(block: _Block) -> Output:
    v = _variable(block)
    block.word("aggregation", {"Maximum": None})
    block.word("lock-previous", {"false": None}, "false")
    locked = block.word("lock-range", {"true": True, "false": False}, "false")
    line, value = block.entries.get("default", (block.line, "nan"))
    default = None if value == "nan" else read_number(value, line, f"default of {block.name!r}")
    if locked and default is not None and not v.universe[0] <= default <= v.universe[1]:
        refuse(line, f"default of {block.name!r} is {value}, outside the range that lock-range holds it to")
    with located(f"line {block.line}"):
        return Output(v.name, v.universe, v.terms, default)


def _resolution(block: _Block) -> int:
    line, value = block.entries.get("defuzzifier", (block.line, ""))
    match = re.fullmatch(r"Centroid(?:\s+([0-9]{1,4000}))?", value)
    if not match:
        refuse(line, f"defuzzifier of {block.name!r} is {value or 'missing'}, expected Centroid and its resolution")
    return int(match[1] or RESOLUTION)


def _norms(block: _Block, rules: Sequence[tuple[int, Rule]]) -> dict[str, str]:
    block.require_enabled()
    block.word("activation", {"General": None})
    # an operator that no rule needs may be none
    joins = {kind for _, rule in rules for kind in _joins(rule.condition)}
    none_and = {} if And in joins else {"none": "min", "": "min"}
    none_or = {} if Or in joins else {"none": "max", "": "max"}
    return {
        "conjunction": block.word("conjunction", CONJUNCTIONS | none_and),
        "disjunction": block.word("disjunction", DISJUNCTIONS | none_or),
        "implication": block.word("implication", CONJUNCTIONS),
    }


def _joins(p: Proposition) -> set[type[Proposition]]:
    if isinstance(p, Not):
        return _joins(p.part)
    return {type(p)}.union(*map(_joins, p.parts)) if isinstance(p, And | Or) else set()


def _rules(block: _Block) -> list[tuple[int, Rule]]:
    rules: list[tuple[int, Rule]] = []
    for line, content in block.many:
        hedge = next((word for word in content.split() if word in HEDGES and word != "not"), None)
        if hedge is not None:
            refuse(line, f"rule {content!r}: the hedge {hedge!r} is not known here, expected only 'not'")
        with located(f"line {line}"):
            rules.append((line, parse_rule(content)))
    return rules
