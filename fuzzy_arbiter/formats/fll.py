"""The FuzzyLite Language, as pyfuzzylite and fuzzylite read and write it."""

from __future__ import annotations

import re
from typing import Any

from fuzzy_arbiter.definition import WEIGHTED, Output, System, Variable
from fuzzy_arbiter.errors import FormatError, UnsupportedError
from fuzzy_arbiter.formats.blocks import Block, RuleBlock, assemble, group_rules
from fuzzy_arbiter.formats.fll_terms import FUNCTION_NAMES, RESERVED, VALUES, format_shape, read_shape
from fuzzy_arbiter.formats.notation import (
    format_number,
    format_numbers,
    located,
    read_number,
    refuse,
    require_words,
    unsupported_rule,
)
from fuzzy_arbiter.formats.settings import format_settings, read_settings, settings_of
from fuzzy_arbiter.formats.vocabulary import WORDS, operator_words, word_of
from fuzzy_arbiter.propositions import And, Anything, Hedged, Is, Not, Or, Proposition
from fuzzy_arbiter.rule import Operators, Rule, parse_rules
from fuzzy_arbiter.terms.norms import HEDGES
from fuzzy_arbiter.terms.term import Term

_WORDS = WORDS["fll"]
_FLAGS = {"true": True, "false": False}
_RESOLUTION = 1000  # fuzzylite's default for its defuzzifiers
_VARIABLE = ("description", "enabled", "range", "lock-range", "term")
_KEYS = {
    "Engine": ("description",),
    "InputVariable": _VARIABLE,
    "OutputVariable": (*_VARIABLE, "aggregation", "defuzzifier", "default", "lock-previous"),
    "RuleBlock": ("description", "enabled", "conjunction", "disjunction", "implication", "activation", "rule"),
}
_OLD = {"accumulation": "aggregation", "lock-valid": "lock-previous"}  # keys of fuzzylite 5


def read(text: str) -> System:
    """Parse a text in the FuzzyLite Language as a system."""
    # `points` is the greatest resolution of any output's defuzzifier; a default of `nan` is none; locked ranges clip
    # inputs. An aggregation of `none` adds the strengths of values, as fuzzylite does. Terms of one name are refused,
    # for rules mean the first in fuzzylite and the last in pyfuzzylite.
    parts, comments = _blocks(text)
    engines, inputs, outputs, rule_blocks = ([b for b in parts if b.kind == kind] for kind in _KEYS)
    if len(engines) != 1:
        raise FormatError(f"expected one Engine in a FLL file, got {len(engines) or 'none'}")
    for block in (*inputs, *outputs, *rule_blocks):
        block.word("enabled", {"true": None}, "true")
    variables = [block.build(Variable, *_parts(block)) for block in inputs]
    outside = [block.word("lock-range", {"true": "clip", "false": "refuse"}, "false") for block in inputs]
    for block, other in zip(inputs, outside, strict=True):
        if other != outside[0]:
            where = f"{block.name!r} has another lock-range than {inputs[0].name!r}"
            refuse(block.line, f"{where}, expected the same for all")
    parsed = [_output(block, len(inputs)) for block in outputs]
    results = [output for output, _ in parsed]
    values = {output.name for output in results if output.weighted}
    options = {
        "name": engines[0].name or "arbiter",
        "outside": outside[0] if outside else "refuse",
        "points": max((points for _, points in parsed), default=0) or _RESOLUTION,
        **read_settings(comments, settings_of(results)),
    }
    return assemble(engines[0].line, variables, results, [_rules(block, values) for block in rule_blocks], **options)


def _blocks(text: str) -> tuple[list[Block], list[tuple[int, str]]]:
    blocks: list[Block] = []
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
        if key in _KEYS:
            blocks.append(Block(key, value, line))
        elif not blocks:
            refuse(line, f"got {key!r}, expected Engine first")
        else:
            blocks[-1].add(line, _OLD.get(key, key), value, _KEYS[blocks[-1].kind], many=("term", "rule"))
    return blocks, comments


def _parts(block: Block, inputs: int | None = None) -> tuple[str, tuple[float, float], tuple[Term, ...]]:
    """Return the name, the universe and the terms of a variable."""
    line, value = block.entry("range")
    bounds = [read_number(part, line, "range") for part in value.split()]
    if len(bounds) != 2:
        refuse(line, f"range of {block.title} is {value or 'missing'}, expected two numbers")
    terms: list[Term] = []
    for line, content in block.many:
        name, kind, numbers = (*content.split(maxsplit=2), "", "", "")[:3]
        with located(f"line {line}: term {name!r}"):
            terms.append(Term(name, read_shape(kind, numbers, line, inputs)))
    return block.name, (bounds[0], bounds[1]), tuple(terms)


def _output(block: Block, inputs: int) -> tuple[Output, int]:
    """Return an output, and the points of its defuzzifier, 0 for values."""
    parts = _parts(block, inputs)
    defuzzifier, points = _defuzzifier(block)
    none = {"none": "sum", "": "sum"} if defuzzifier in WEIGHTED else {}
    aggregation = block.word("aggregation", _WORDS["aggregation"] | none)
    locked, previous = (block.word(key, _FLAGS, "false") for key in ("lock-range", "lock-previous"))
    default = block.number("default")
    return block.build(Output, *parts, default, defuzzifier, aggregation, locked, previous), points


def _defuzzifier(block: Block) -> tuple[Any, int]:
    line, value = block.entry("defuzzifier")
    word, _, option = value.partition(" ")
    option = option.strip()
    if word not in _WORDS["defuzzifier"]:
        expected = ", ".join(_WORDS["defuzzifier"])
        refuse(line, f"defuzzifier of {block.title} is {value or 'missing'}, expected one of {expected}")
    name = _WORDS["defuzzifier"][word]
    if name in WEIGHTED:
        if option not in ("", "Automatic", "TakagiSugeno", "Tsukamoto"):
            refuse(line, f"{word} has the type {option!r}, expected Automatic, TakagiSugeno or Tsukamoto")
        kinds = {content.split(maxsplit=2)[1] in VALUES for _, content in block.many if len(content.split()) > 1}
        wrong = {"TakagiSugeno": False, "Tsukamoto": True}.get(option)
        if wrong in kinds:
            refuse(line, f"{word} has the type {option}, for which a term of {block.name!r} is not made")
        return name, 0
    if not re.fullmatch(r"[0-9]{0,4000}", option):
        refuse(line, f"defuzzifier of {block.title} is {value}, expected {word} and its resolution")
    return name, int(option or _RESOLUTION)


def _rules(block: Block, values: set[str]) -> RuleBlock:
    """Return the operators of a block, of which one that no rule needs may be missing, and its rules."""
    rules = block.rules(lambda _, text: parse_rules(text))
    if block.entry("activation")[1] in _WORDS["implication"] and "implication" not in block.entries:
        block.entries["implication"] = block.entries.pop("activation")  # the word of fuzzylite 5
    block.word("activation", {"General": None, "": None})
    joins = {type(part) for _, rule in rules for part in rule.condition.parts_within()}
    needed = {
        "conjunction": And in joins,
        "disjunction": Or in joins,
        "implication": any(c.variable not in values for _, rule in rules for c in rule.conclusions),
    }
    usual = Operators()
    missing = {key: {} if needed[key] else dict.fromkeys(("none", ""), getattr(usual, key)) for key in needed}
    return Operators(**{key: block.word(key, _WORDS[key] | missing[key]) for key in needed}), rules


def write(system: System) -> str:
    """Format a system in the FuzzyLite Language."""
    if "#" in system.name:
        raise UnsupportedError(f"fll cannot express the name {system.name!r}: what follows # is a comment")
    require_words(system, "fll", RESERVED, FUNCTION_NAMES)
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
    for k, (operators, rules) in enumerate(group_rules(system)):
        lines += [f"RuleBlock: rules{k + 1 if k else ''}", "  enabled: true"]
        keys = ("conjunction", "disjunction", "implication")
        lines += [f"  {key}: {word}" for key, word in zip(keys, operator_words("fll", operators), strict=True)]
        lines += ["  activation: General", *(f"  rule: {_rule(i, rule)}" for i, rule in rules)]
    return "\n".join([*lines, ""])


def _rule(i: int, rule: Rule) -> str:
    conclusions = " and ".join(_condition(conclusion, i, rule) for conclusion in rule.conclusions)
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
