"""Read the FuzzyLite Language."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from fuzzy_arbiter.definition import Output, System, Variable
from fuzzy_arbiter.errors import FormatError
from fuzzy_arbiter.formats.fll_terms import VALUES, read_shape
from fuzzy_arbiter.formats.fll_words import (
    CONJUNCTIONS,
    DEFUZZIFIERS,
    DISJUNCTIONS,
    JOINS,
    KEYS,
    MANY,
    OLD,
    RESOLUTION,
    settings_of,
)
from fuzzy_arbiter.formats.notation import NumberedRule, assembled, join_rule_blocks, located, read_number, refuse
from fuzzy_arbiter.formats.settings import read_settings
from fuzzy_arbiter.propositions import And, Not, Or, Proposition
from fuzzy_arbiter.rule import Operators
from fuzzy_arbiter.rule_text import parse_rules
from fuzzy_arbiter.terms.term import Term


@dataclass
class _Block:
    """The lines of one engine, variable or rule block."""

    kind: str
    name: str
    line: int
    entries: dict[str, tuple[int, str]] = field(default_factory=dict)
    many: list[tuple[int, str]] = field(default_factory=list)

    def word(self, key: str, known: dict[str, Any], missing: str = "") -> Any:
        """Look up the word of a key in `known`; refuse another word."""
        line, value = self.entries.get(key, (self.line, missing))
        if value not in known:
            expected = " or ".join(word for word in known if word)
            refuse(line, f"{key} of {self.name!r} is {value or 'missing'}, expected {expected}")
        return known[value]

    def require_enabled(self) -> None:
        self.word("enabled", {"true": None}, "true")


def read(text: str) -> System:
    """Parse a text in the FuzzyLite Language as a system."""
    # `points` is the greatest resolution of any output's defuzzifier; a default of `nan` is none; locked ranges clip
    # inputs. An aggregation of `none` adds the strengths of values, as fuzzylite does. Terms of one name are refused,
    # for rules mean the first in fuzzylite and the last in pyfuzzylite.
    blocks, comments = _blocks(text)
    engines = [b for b in blocks if b.kind == "Engine"]
    if len(engines) != 1:
        raise FormatError(f"expected one Engine in a FLL file, got {len(engines) or 'none'}")
    inputs = [b for b in blocks if b.kind == "InputVariable"]
    outputs = [b for b in blocks if b.kind == "OutputVariable"]
    variables = [Variable(*_variable(b)) for b in inputs]
    parsed = [_output(b, len(inputs)) for b in outputs]
    results = [output for output, _ in parsed]
    clips = _alike(inputs, [b.word("lock-range", {"true": "clip", "false": "refuse"}, "false") for b in inputs])
    settings = read_settings(comments, settings_of(results))
    values = {output.name for output in results if output.weighted}
    norms, rules = join_rule_blocks([_rules(b, values) for b in blocks if b.kind == "RuleBlock"])
    name = engines[0].name or "arbiter"
    options = {
        "outside": clips or "refuse",
        "points": max((points for _, points in parsed), default=0) or RESOLUTION,
        **norms,
        **settings,
    }
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
            refuse(line, f"got {key!r}, expected Engine first")
        block = blocks[-1]
        key = OLD.get(key, key)
        if key not in KEYS[block.kind]:
            refuse(line, f"{key!r} is not known in {block.kind}, expected one of {', '.join(KEYS[block.kind])}")
        if key in MANY:
            block.many.append((line, value))
        elif key in block.entries:
            refuse(line, f"{key} appears twice in {block.kind} {block.name!r}")
        else:
            block.entries[key] = line, value
    return blocks, comments


def _alike(blocks: Sequence[_Block], values: Sequence[Any]) -> Any:
    """Return the value that all variables share, and refuse different ones; None without variables."""
    for block, value in zip(blocks, values, strict=True):
        if value != values[0]:
            where = f"{block.name!r} has another lock-range than {blocks[0].name!r}"
            refuse(block.line, f"{where}, expected the same for all")
    return values[0] if values else None


def _variable(block: _Block, inputs: int | None = None) -> tuple[str, tuple[float, float], tuple[Term, ...]]:
    block.require_enabled()
    line, value = block.entries.get("range", (block.line, ""))
    bounds = [read_number(part, line, "range") for part in value.split()]
    if len(bounds) != 2:
        refuse(line, f"range of {block.name!r} is {value or 'missing'}, expected two numbers")
    terms: list[Term] = []
    for line, content in block.many:
        name, kind, numbers = (*content.split(maxsplit=2), "", "", "")[:3]
        with located(f"line {line}: term {name!r}"):
            terms.append(Term(name, read_shape(kind, numbers, line, inputs)))
    parts = block.name, (bounds[0], bounds[1]), tuple(terms)
    if inputs is None:
        with located(f"line {block.line}"):
            Variable(*parts)
    return parts


def _output(block: _Block, inputs: int) -> tuple[Output, int]:
    """Return an output, and the points of its defuzzifier, 0 for values."""
    parts = _variable(block, inputs)
    defuzzifier, points = _defuzzifier(block)
    none = {"none": "sum", "": "sum"} if defuzzifier in ("average", "sum") else {}
    aggregation = block.word("aggregation", JOINS | none)
    locks = {"true": True, "false": False}
    locked, previous = block.word("lock-range", locks, "false"), block.word("lock-previous", locks, "false")
    line, value = block.entries.get("default", (block.line, "nan"))
    default = None if value == "nan" else read_number(value, line, f"default of {block.name!r}")
    if locked and default is not None and not parts[1][0] <= default <= parts[1][1]:
        refuse(line, f"default of {block.name!r} is {value}, outside the range that lock-range holds it to")
    with located(f"line {block.line}"):
        return Output(*parts, default, defuzzifier, aggregation, locked, previous), points


def _defuzzifier(block: _Block) -> tuple[Any, int]:
    line, value = block.entries.get("defuzzifier", (block.line, ""))
    word, _, option = value.partition(" ")
    option = option.strip()
    if word not in DEFUZZIFIERS:
        refuse(
            line, f"defuzzifier of {block.name!r} is {value or 'missing'}, expected one of {', '.join(DEFUZZIFIERS)}"
        )
    name = DEFUZZIFIERS[word]
    if name in ("average", "sum"):
        if option not in ("", "Automatic", "TakagiSugeno", "Tsukamoto"):
            refuse(line, f"{word} has the type {option!r}, expected Automatic, TakagiSugeno or Tsukamoto")
        kinds = {content.split(maxsplit=2)[1] in VALUES for _, content in block.many if len(content.split()) > 1}
        wrong = {"TakagiSugeno": False, "Tsukamoto": True}.get(option)
        if wrong in kinds:
            refuse(line, f"{word} has the type {option}, for which a term of {block.name!r} is not made")
        return name, 0
    if not re.fullmatch(r"[0-9]{0,4000}", option):
        refuse(line, f"defuzzifier of {block.name!r} is {value}, expected {word} and its resolution")
    return name, int(option or RESOLUTION)


def _rules(block: _Block, values: set[str]) -> tuple[Operators, list[NumberedRule]]:
    """Return the operators of a block, of which one that no rule needs may be missing, and its rules."""
    block.require_enabled()
    rules: list[NumberedRule] = []
    for line, content in block.many:
        with located(f"line {line}"):
            rules += [(line, rule) for rule in parse_rules(content)]
    if block.entries.get("activation", (0, ""))[1] in CONJUNCTIONS and "implication" not in block.entries:
        block.entries["implication"] = block.entries.pop("activation")  # the word of fuzzylite 5
    block.word("activation", {"General": None, "": None})
    joins = {kind for _, rule in rules for kind in _joins(rule.condition)}
    implied = any(c.variable not in values for _, rule in rules for c in rule.conclusions)
    none_and = {} if And in joins else {"none": "min", "": "min"}
    none_or = {} if Or in joins else {"none": "max", "": "max"}
    operators = Operators(
        block.word("conjunction", CONJUNCTIONS | none_and),
        block.word("disjunction", DISJUNCTIONS | none_or),
        block.word("implication", CONJUNCTIONS | ({} if implied else {"none": "min", "": "min"})),
    )
    return operators, rules


def _joins(p: Proposition) -> set[type[Proposition]]:
    if isinstance(p, Not):
        return _joins(p.part)
    return {type(p)}.union(*map(_joins, p.parts)) if isinstance(p, And | Or) else set()
