"""The text of MATLAB's Fuzzy Logic Toolbox, which Octave's fuzzy-logic-toolkit reads too."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any

from fuzzy_arbiter.definition import WEIGHTED, Output, System, Variable, variable_names
from fuzzy_arbiter.errors import FormatError, UnsupportedError
from fuzzy_arbiter.formats.blocks import Block, assemble
from fuzzy_arbiter.formats.fis_rules import read_rules, with_complements
from fuzzy_arbiter.formats.fis_terms import numbers_of, read_function, with_unique_names
from fuzzy_arbiter.formats.fll_terms import parts_of
from fuzzy_arbiter.formats.notation import format_number, format_numbers, located, refuse, unsupported_rule
from fuzzy_arbiter.formats.settings import format_settings, read_settings
from fuzzy_arbiter.formats.vocabulary import WORDS, operator_words, word_of
from fuzzy_arbiter.propositions import And, Is, Not, Or
from fuzzy_arbiter.rule import Operators
from fuzzy_arbiter.shapes import Membership, Shape
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.kinds import KINDS
from fuzzy_arbiter.terms.term import Term
from fuzzy_arbiter.terms.values import Formula, Value

_SECTION = re.compile(r"\[\s*(System|Input|Output|Rules)\s*([1-9][0-9]{0,8})?\s*\]", re.ASCII)
_ENTRY = re.compile(r"(\w+)\s*=\s*(.*)", re.ASCII)
_QUOTED = re.compile(r"'([^']*)'")
_LIST = re.compile(r"\[([^][]*)\]")
_FUNCTION = re.compile(r"'([^']*)'\s*:\s*'([^']*)'\s*,\s*\[([^][]*)\]")
_METHODS = {
    "AndMethod": "conjunction",
    "OrMethod": "disjunction",
    "ImpMethod": "implication",
    "AggMethod": "aggregation",
}
_TEXTS = ("Name", "Type", *_METHODS, "DefuzzMethod")
_SYSTEM_KEYS = (*_TEXTS, "Version", "NumInputs", "NumOutputs", "NumRules")
# types, and whether their outputs are values; the last two are fuzzylite's
_TYPES = {"mamdani": False, "sugeno": True, "tsukamoto": True, "hybrid": None}
# keys of a variable that fuzzylite's versions 3 to 5 add
_FUZZYLITE_KEYS = ("Enabled", "Default", "LockRange", "LockPrevious")
_FLAGS = {"1": True, "0": False}

_SIGNS = "'=:,"  # characters at which MATLAB's reader splits lines
MATLAB = ("gaussmf", "gauss2mf", "gbellmf", "sigmf", "dsigmf", "psigmf", "zmf", "smf", "pimf")  # not fuzzylite's alone
_Parts = tuple[str, tuple[float, float], tuple[Term, ...]]


def read(text: str) -> System:
    """Parse MATLAB's text as a system."""
    # Terms of one name are numbered, as rules speak of them by their place. Where a rule concludes that an output is
    # not in a term, its complement becomes a term of its own. The strengths of rules that conclude one value are added,
    # whatever AggMethod says, as MATLAB does it; where a comment names the fuzzy-logic-toolkit, they are joined as
    # AggMethod defines, as in Octave.
    sections, comments = _sections(text)
    settings = read_settings(comments)
    if "System" not in sections or "Rules" not in sections:
        raise FormatError("expected the sections [System] and [Rules] of a FIS file, among others")
    system = sections["System"]
    norms = {kind: system.word(key, WORDS["fis"][kind]) for key, kind in _METHODS.items()}
    if not system.entry("AndMethod")[1] and norms["disjunction"] == "probor":
        norms["conjunction"] = "prod"
    aggregation = norms.pop("aggregation")
    words = " ".join(text for _, text in comments)
    fuzzylite = "generated with fuzzylite" in words or any(
        key in _FUZZYLITE_KEYS for section in sections.values() for key in section.entries
    )
    inputs = [section.build(Variable, *_parts(section, None)) for section in _numbered(sections, "Input")]
    joins = {False: aggregation, True: aggregation if "fuzzy-logic-toolkit" in words else "sum"}
    outputs = [_output(section, len(inputs), system, joins) for section in _numbered(sections, "Output")]
    table = sections["Rules"]
    for key, count in (("NumInputs", len(inputs)), ("NumOutputs", len(outputs)), ("NumRules", len(table.many))):
        _require_count(system, key, count)
    rules = table.rules(lambda line, row: read_rules(line, row, inputs, outputs, fuzzylite))
    outputs = [with_complements(output, rules) for output in outputs]
    block = Operators(**norms), rules
    return assemble(system.line, inputs, outputs, [block], name=system.name or "arbiter", **settings)


def _sections(text: str) -> tuple[dict[str, Block], list[tuple[int, str]]]:
    sections: dict[str, Block] = {}
    comments: list[tuple[int, str]] = []
    section: Block | None = None
    for line, raw in enumerate(text.split("\n"), 1):
        content = raw.strip()
        if content.startswith(("%", "#")):
            comments.append((line, content[1:]))
        elif head := _SECTION.fullmatch(content):
            kind = head[1] + (head[2] or "")
            if (head[1] in ("Input", "Output")) != bool(head[2]):
                refuse(line, f"section {content!r}, expected [System], [Input1], [Output1], [Rules] and so on")
            if kind in sections:
                refuse(line, f"section {content!r} appears twice")
            section = sections[kind] = Block(kind, "", line)
        elif content and (section is None or content.startswith("[")):
            refuse(line, f"{content!r}, expected a section such as [System], [Input1], [Output1] or [Rules]")
        elif content and section and section.kind == "Rules":
            section.many.append((line, content))
        elif content and section:
            _add_entry(section, line, content)
    return sections, comments


def _add_entry(section: Block, line: int, content: str) -> None:
    entry = _ENTRY.fullmatch(content)
    if not entry:
        refuse(line, f"{content!r}, expected a key, = and its value")
    key, value = entry.groups()
    if re.match(r"TypeRed|MF[0-9]+[UL]", key):
        refuse(line, f"{key} is of a type-2 system, expected one of type 1")
    if key in _TEXTS:
        quoted = _QUOTED.fullmatch(value)
        value = quoted[1] if quoted else refuse(line, f"{key} is {value}, expected text in single quotes")
    section.add(line, key, value, _SYSTEM_KEYS if section.kind == "System" else ())
    if key == "Name":
        section.name = value


def _require_count(section: Block, key: str, count: int) -> None:
    line, value = section.entry(key)
    if value != str(count):
        refuse(line, f"{key} of {section.title} is {value or 'missing'}, expected {count}, since there are {count}")


def _defuzzifier(system: Block) -> Any:
    """Return the defuzzifier of all outputs; in a hybrid file those of values take the weighted mean."""
    kind = system.entry("Type")[1] or "mamdani"
    if re.search(r"type-?2$", kind):
        refuse(system.entry("Type")[0], f"Type is {kind}, a type-2 system; expected one of type 1")
    weighted = system.word("Type", {**_TYPES, "": False})
    line, word = system.entry("DefuzzMethod")
    word = word or ("centroid" if kind == "mamdani" else "wtaver")
    known = {key: name for key, name in WORDS["fis"]["defuzzifier"].items() if weighted in (None, name in WEIGHTED)}
    if word not in known:
        refuse(line, f"DefuzzMethod is {word!r} in a file of the type {kind!r}, expected {' or '.join(known)}")
    return known[word]


def _numbered(sections: dict[str, Block], kind: str) -> list[Block]:
    """Return the sections of one kind in the order of their numbers."""
    alike = [section for section in sections.values() if section.kind.startswith(kind)]
    expected = [f"{kind}{k}" for k in range(1, len(alike) + 1)]
    for key in expected:
        if key not in sections:
            refuse(alike[-1].line, f"got [{alike[-1].kind}] without [{key}]; expected them numbered from 1")
    return [sections[key] for key in expected]


def _output(section: Block, inputs: int, system: Block, joins: dict[bool, str]) -> Output:
    """Return an output, whose values or sets are joined by these aggregations."""
    parts, defuzzifier = _parts(section, inputs), _defuzzifier(system)
    values = any(not isinstance(term.shape, Membership) or isinstance(term.shape, Formula) for term in parts[2])
    if values and defuzzifier not in WEIGHTED and system.entry("Type")[1] == "hybrid":
        defuzzifier = "average"
    locks = section.word("LockRange", _FLAGS, "0"), section.word("LockPrevious", _FLAGS, "0")
    options = section.number("Default"), defuzzifier, joins[defuzzifier in WEIGHTED], *locks
    return section.build(Output, *parts, *options)


def _parts(section: Block, inputs: int | None) -> _Parts:
    """Return the name, the universe and the terms of a variable."""
    for key in ("Name", "Range"):
        if key not in section.entries:
            refuse(section.line, f"{section.title} has no {key}")
    line, value = section.entry("Range")
    match = _LIST.fullmatch(value)
    bounds = numbers_of(match[1], line, f"Range of {section.title}") if match else []
    if len(bounds) != 2:
        refuse(line, f"Range of {section.title} is {value}, expected two numbers in brackets")
    section.word("Enabled", {"1": True}, "1")
    known = ("Name", "Range", "NumMFs", *(_FUZZYLITE_KEYS if inputs is not None else _FUZZYLITE_KEYS[:1]))
    functions = {key: entry for key, entry in section.entries.items() if key not in known}
    _require_count(section, "NumMFs", len(functions))
    terms: list[Term] = []
    for j, (key, (line, value)) in enumerate(functions.items(), 1):
        if key != f"MF{j}":
            refuse(line, f"got {key} in {section.title}, expected MF{j}")
        match = _FUNCTION.fullmatch(value)
        if not match:
            refuse(line, f"{value}, expected a membership function such as 'low':'trimf',[-1 0 1]")
        term, function, parameters = match.groups()
        with located(f"line {line}: term {term!r}"):
            terms.append(Term(term, read_function(function, parameters, line, term, inputs)))
    return section.name, (bounds[0], bounds[1]), with_unique_names(terms)


def write(system: System) -> str:
    """Format a system as MATLAB's text."""
    names = [name for v in (*system.inputs, *system.outputs) for name in (v.name, *v.term_names)]
    for name in (system.name, *names):
        if any(sign in name for sign in _SIGNS):
            raise UnsupportedError(f"fis cannot express the name {name!r}: expected none of {' '.join(_SIGNS)}")
    type_word, method, aggregation = _method(system)
    keys = zip(_METHODS, (*operator_words("fis", system), aggregation), strict=True)
    lines = [f"% {text}" for text in format_settings(system)]
    lines += ["[System]", f"Name='{system.name}'", f"Type='{type_word}'", "Version=2.0"]
    lines += [f"NumInputs={len(system.inputs)}", f"NumOutputs={len(system.outputs)}", f"NumRules={len(system.rules)}"]
    lines += [*(f"{key}='{word}'" for key, word in keys), f"DefuzzMethod='{method}'", ""]
    for kind, variables in (("Input", system.inputs), ("Output", system.outputs)):
        for k, v in enumerate(variables, 1):
            lines += [f"[{kind}{k}]", f"Name='{v.name}'", f"Range=[{format_numbers(v.universe)}]"]
            lines += [
                f"NumMFs={len(v.terms)}",
                *(f"MF{j}={_format_term(term, v)}" for j, term in enumerate(v.terms, 1)),
            ]
            lines.append("")
    return "\n".join([*lines, "[Rules]", *(_format_rule(system, i) for i in range(len(system.rules))), ""])


def _method(system: System) -> tuple[str, str, str]:
    """Return the type of a system, and the words of its defuzzifier and aggregation, which all outputs share."""
    for output in system.outputs:
        for key, usual in (("default", None), ("lock_range", False), ("lock_previous", False)):
            if getattr(output, key) is not usual:
                raise UnsupportedError(
                    f"fis cannot express the {key} {getattr(output, key)!r} of output {output.name!r}"
                )
    pairs = list(dict.fromkeys((o.defuzzifier, o.aggregation) for o in system.outputs))
    if len(pairs) > 1:
        several = f"several defuzzifiers and aggregations, {'; '.join(map(', '.join, pairs))}"
        raise UnsupportedError(f"fis cannot express outputs of {several}: expected one")
    ((defuzzifier, aggregation),) = pairs
    method = word_of("fis", "defuzzifier", defuzzifier)
    if defuzzifier not in WEIGHTED:
        return "mamdani", method, word_of("fis", "aggregation", aggregation)
    if aggregation != "sum":
        raise UnsupportedError(f"fis cannot express the aggregation {aggregation!r} of values: expected 'sum'")
    values = all(isinstance(term.shape, Value) for output in system.outputs for term in output.terms)
    return ("sugeno" if values else "tsukamoto"), method, "sum"


def _format_term(term: Term, v: Variable) -> str:
    """Format a term's name, function and parameters."""
    shape, what = term.shape, f"fis cannot express the term {term.name!r} of {v.name!r}"
    word, numbers, _ = parts_of(shape)
    if isinstance(shape, Shape):
        function = _straight(shape, v)
        if function is None:
            points = " ".join(f"({format_number(x)}, {format_number(degree)})" for x, degree in shape.points)
            raise UnsupportedError(f"{what}, {points}: expected a triangle, a trapezoid or a half")
        word, numbers = function
    elif word == "formula":
        raise UnsupportedError(f"{what}, a formula: expected a function of MATLAB's, a constant or a linear term")
    elif isinstance(shape, Curve):
        word, order = ("trimf", (0, 0, 0)) if shape.kind == "singleton" else KINDS[shape.kind].fis
        numbers = tuple(numbers[i] for i in order)
        if word not in ("trimf", *MATLAB) or shape.height != 1.0:
            expected = f"expected one of {', '.join(MATLAB)}"
            raise UnsupportedError(f"{what}, {shape.kind} of the height {shape.height:g}: {expected}")
    return f"'{term.name}':'{word}',[{format_numbers(numbers)}]"


def _straight(shape: Shape, v: Variable) -> tuple[str, tuple[float, ...]] | None:
    """Return the function and parameters of a shape; half a triangle has its foot beyond the range, for Octave."""
    low, high = v.universe

    def beyond(x: float, sign: float) -> float:
        further = x + sign * (high - low)
        return further if further != x else math.nextafter(x, sign * math.inf)

    points = tuple(x for x, _ in shape.points)
    degrees = [degree for _, degree in shape.points]
    if isinstance(v, Output) and v.weighted:  # a ramp of Tsukamoto's method, for which fuzzylite alone has a word
        return ("rampmf", points if degrees[0] == 0.0 else points[::-1]) if max(degrees) == 1.0 else None
    before, after = beyond(low, -1.0), beyond(high, 1.0)
    match degrees:
        case [0.0, 1.0, 0.0] | [0.0, 1.0, 1.0, 0.0]:
            pass
        case [0.0, 1.0]:
            points = (*points, beyond(points[1], 1.0)) if points[1] >= high else (*points, high, after)
        case [1.0, 0.0]:
            points = (beyond(points[0], -1.0), *points) if points[0] <= low else (before, low, *points)
        case [1.0]:
            points = (before, low, high, after)
        case [0.0]:
            points = (high, after, beyond(after, 1.0))
        case _:
            return None
    return ("trimf" if len(points) == 3 else "trapmf", points) if all(map(math.isfinite, points)) else None


def _format_rule(system: System, i: int) -> str:
    rule = system.rules[i]
    condition = rule.condition
    if rule.operators is not None:
        raise unsupported_rule("fis", i, rule, "those of the system", "operators")
    parts = condition.parts if isinstance(condition, And | Or) else (condition,)
    statements = [part.part if isinstance(part, Not) else part for part in parts]
    names = variable_names(system.inputs)
    if not all(isinstance(one, Is) and one.variable in names for one in statements):
        raise unsupported_rule("fis", i, rule, "one connective per rule, and only terms negated")
    row = _indices([one for one in statements if isinstance(one, Is)], system.inputs)
    if row is None:
        raise unsupported_rule("fis", i, rule, "each input once, in the order of the inputs")
    for part, one in zip(parts, statements, strict=True):
        if part is not one and isinstance(one, Is):
            row[names.index(one.variable)] *= -1
    concluded = _indices(rule.conclusions, system.outputs)
    if concluded is None:
        raise unsupported_rule("fis", i, rule, "each output in the order of the outputs", "conclusions")
    numbers = f"{' '.join(map(str, row))}, {' '.join(map(str, concluded))}"
    return f"{numbers} ({format_number(rule.weight)}) : {2 if isinstance(condition, Or) else 1}"


def _indices(statements: Sequence[Is], variables: Sequence[Variable]) -> list[int] | None:
    """Return of each variable the number of its term from 1, or 0; None unless statements are in their order."""
    terms = {one.variable: one.term for one in statements}
    if len(terms) < len(statements) or list(terms) != [v.name for v in variables if v.name in terms]:
        return None
    return [v.term_names.index(terms[v.name]) + 1 if v.name in terms else 0 for v in variables]
