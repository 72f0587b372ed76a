"""Reads MATLAB's text."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from fuzzy_arbiter.definition import WEIGHTED, Output, System, Variable
from fuzzy_arbiter.errors import FormatError
from fuzzy_arbiter.formats.fis_terms import numbers_of, read_function
from fuzzy_arbiter.formats.fis_words import DEFUZZIFIERS, HEDGES, METHODS, OCTAVE_HEDGES, SETTINGS, TYPES
from fuzzy_arbiter.formats.notation import assembled, located, read_number, refuse
from fuzzy_arbiter.formats.settings import read_settings
from fuzzy_arbiter.propositions import And, Anything, Hedged, Is, Not, Or, Proposition
from fuzzy_arbiter.rule import Rule
from fuzzy_arbiter.rule_text import bent_rules
from fuzzy_arbiter.shapes import Membership
from fuzzy_arbiter.terms.term import Term
from fuzzy_arbiter.terms.values import Formula

_SECTION = re.compile(r"\[\s*(System|Input|Output|Rules)\s*([1-9][0-9]{0,8})?\s*\]", re.ASCII)
_ENTRY = re.compile(r"(\w+)\s*=\s*(.*)", re.ASCII)
_QUOTED = re.compile(r"'([^']*)'")
_LIST = re.compile(r"\[([^][]*)\]")
_FUNCTION = re.compile(r"'([^']*)'\s*:\s*'([^']*)'\s*,\s*\[([^][]*)\]")
_RULE = re.compile(r"([^,()]*),([^,()]*)\(([^()]*)\)\s*:\s*(\S+)")
_COUNTS = ("NumInputs", "NumOutputs", "NumRules")
_SYSTEM_KEYS = ("Name", "Type", "Version", *_COUNTS, *METHODS, "DefuzzMethod")


@dataclass
class _Section:
    """The lines of one section: entries by key, and those that are no entries."""

    name: str
    line: int
    entries: dict[str, tuple[int, str]] = field(default_factory=dict)
    rows: list[tuple[int, str]] = field(default_factory=list)

    def string(self, key: str) -> str | None:
        if key not in self.entries:
            return None
        line, value = self.entries[key]
        match = _QUOTED.fullmatch(value)
        return match[1] if match else refuse(line, f"{key} is {value}, expected text in single quotes")

    def require_count(self, key: str, count: int) -> None:
        line, value = self.entries.get(key, (self.line, ""))
        if value != str(count):
            refuse(line, f"{key} is {value or 'missing'}, expected {count}, since there are {count}")


def read(text: str) -> System:
    """Return the system that MATLAB's text defines.

    Terms of one name are numbered, as rules speak of them by their place. The strengths of rules that conclude one
    value are added, whatever AggMethod says, as MATLAB does it.

    Parameters
    ----------
    text : str
        All of a file.

    Returns
    -------
    System
        Without defaults, which the format does not know.

    Raises
    ------
    FormatError
        If the text is not of this format, or says what this package does not know; the line is named.
    DefinitionError
        If what it defines cannot be.
    """
    sections, comments = _sections(text)
    settings = read_settings(comments, SETTINGS)
    if "System" not in sections or "Rules" not in sections:
        raise FormatError("expected the sections [System] and [Rules] of a FIS file, among others")
    system = sections["System"]
    norms, defuzzifier, name = _norms(system), _defuzzifier(system), system.string("Name")
    aggregation = norms.pop("aggregation")
    fuzzylite = any("generated with fuzzylite" in text for _, text in comments)
    inputs = [Variable(*parts) for parts in _variables(sections, "Input", None)]
    outputs = _outputs(sections, len(inputs), defuzzifier, aggregation)
    counted = {"NumInputs": len(inputs), "NumOutputs": len(outputs), "NumRules": len(sections["Rules"].rows)}
    for key, count in counted.items():
        system.require_count(key, count)
    rules: list[tuple[int, Rule]] = []
    for line, row in sections["Rules"].rows:
        with located(f"line {line}: {row!r}"):
            rules += [(line, rule) for rule in _rules(line, row, inputs, outputs, fuzzylite)]
    return assembled(system.line, inputs, outputs, rules, name=name or "arbiter", **norms, **settings)


def _sections(text: str) -> tuple[dict[str, _Section], list[tuple[int, str]]]:
    sections: dict[str, _Section] = {}
    comments: list[tuple[int, str]] = []
    section: _Section | None = None
    for line, raw in enumerate(text.split("\n"), 1):
        content = raw.strip()
        if content.startswith(("%", "#")):
            comments.append((line, content[1:]))
            continue
        if not content:
            continue
        head = _SECTION.fullmatch(content)
        if head:
            name = head[1] + (head[2] or "")
            if (head[1] in ("Input", "Output")) != bool(head[2]):
                refuse(line, f"section {content!r}, expected [System], [Input1], [Output1], [Rules] and so on")
            if name in sections:
                refuse(line, f"section {content!r} came twice")
            section = sections[name] = _Section(name, line)
        elif section is None or content.startswith("["):
            refuse(line, f"{content!r}, expected a section such as [System], [Input1], [Output1] or [Rules]")
        elif section.name == "Rules":
            section.rows.append((line, content))
        else:
            entry = _ENTRY.fullmatch(content)
            if not entry:
                refuse(line, f"{content!r}, expected a key, = and its value")
            if entry[1] in section.entries:
                refuse(line, f"{entry[1]} came twice in [{section.name}]")
            section.entries[entry[1]] = line, entry[2]
    return sections, comments


def _norms(system: _Section) -> dict[str, str]:
    for key, (line, _) in system.entries.items():
        if key not in _SYSTEM_KEYS:
            refuse(line, f"{key} is not known in [System], expected one of {', '.join(_SYSTEM_KEYS)}")
    said: dict[str, str] = {}
    for key, known in METHODS.items():
        value = system.string(key)
        if value is not None and value not in known:
            refuse(
                system.entries[key][0],
                f"{key} is {value!r}, which is not known here; expected {' or '.join(filter(None, known))}",
            )
        said[key] = known[value or ""]
    if not system.string("AndMethod") and said["OrMethod"] == "probor":
        said["AndMethod"] = "prod"
    return {
        "conjunction": said["AndMethod"],
        "disjunction": said["OrMethod"],
        "implication": said["ImpMethod"],
        "aggregation": said["AggMethod"],
    }


def _defuzzifier(system: _Section) -> str:
    """Return the defuzzifier of all outputs; in a hybrid file those of values take the weighted mean."""
    kind = system.string("Type") or "mamdani"
    if kind not in TYPES:
        refuse(system.entries["Type"][0], f"Type is {kind!r}, which is not known here; expected {' or '.join(TYPES)}")
    word = system.string("DefuzzMethod") or ("centroid" if kind == "mamdani" else "wtaver")
    found = DEFUZZIFIERS.get(word)
    weighted = {"mamdani": False, "sugeno": True, "tsukamoto": True}.get(kind)
    if found is None or (weighted is not None and weighted != (found in WEIGHTED)):
        line = system.entries.get("DefuzzMethod", (system.line, ""))[0]
        expected = [key for key, name in DEFUZZIFIERS.items() if weighted in (None, name in WEIGHTED)]
        refuse(line, f"DefuzzMethod is {word!r} in a file of the type {kind!r}, expected {' or '.join(expected)}")
    return found


_Parts = tuple[str, tuple[float, float], tuple[Term, ...]]


def _variables(sections: dict[str, _Section], kind: str, inputs: int | None) -> list[_Parts]:
    found = [s for name, s in sections.items() if name.startswith(kind)]
    variables: list[_Parts] = []
    for k in range(1, len(found) + 1):
        section = sections.get(f"{kind}{k}")
        if section is None:
            refuse(found[-1].line, f"[{found[-1].name}] came, and no [{kind}{k}]; expected them numbered from 1")
        variables.append(_variable(section, inputs))
    return variables


def _outputs(sections: dict[str, _Section], inputs: int, defuzzifier: str, aggregation: str) -> list[Output]:
    outputs: list[Output] = []
    for k, parts in enumerate(_variables(sections, "Output", inputs), 1):
        values = any(not isinstance(term.shape, Membership) or isinstance(term.shape, Formula) for term in parts[2])
        own = "average" if values and defuzzifier not in WEIGHTED and _hybrid(sections) else defuzzifier
        join = "sum" if own in WEIGHTED else aggregation
        with located(f"line {sections[f'Output{k}'].line}"):
            outputs.append(Output(*parts, None, own, join))  # type: ignore[arg-type]  # of its words
    return outputs


def _hybrid(sections: dict[str, _Section]) -> bool:
    return sections["System"].string("Type") == "hybrid"


def _variable(section: _Section, inputs: int | None) -> _Parts:
    name = section.string("Name")
    if name is None or "Range" not in section.entries:
        refuse(section.line, f"[{section.name}] without {'Name' if name is None else 'Range'}")
    line, value = section.entries["Range"]
    match = _LIST.fullmatch(value)
    bounds = numbers_of(match[1], line, "Range") if match else []
    if len(bounds) != 2:
        refuse(line, f"Range is {value}, expected two numbers in brackets")
    functions = {key: entry for key, entry in section.entries.items() if key not in ("Name", "Range", "NumMFs")}
    section.require_count("NumMFs", len(functions))
    terms: list[Term] = []
    for j, (key, (line, value)) in enumerate(functions.items(), 1):
        if key != f"MF{j}":
            refuse(line, f"{key} came in [{section.name}], expected MF{j}")
        match = _FUNCTION.fullmatch(value)
        if not match:
            refuse(line, f"{value}, expected a membership function such as 'low':'trimf',[-1 0 1]")
        term, function, places = match.groups()
        with located(f"line {line}: term {term!r}"):
            terms.append(Term(term, read_function(function, places, line, term, inputs)))
    parts = name, (bounds[0], bounds[1]), _told_apart(terms)
    with located(f"line {section.line}"):
        if inputs is None:
            Variable(*parts)
    return parts


def _told_apart(terms: Sequence[Term]) -> tuple[Term, ...]:
    """Return terms with a number after a name that came before, for rules speak of their places."""
    found: list[Term] = []
    for term in terms:
        name, names = term.name, {other.name for other in found}
        for k in range(2, len(terms) + 2):
            if name not in names:
                break
            name = f"{term.name}_{k}"
        found.append(Term(name, term.shape))
    return tuple(found)


def _rules(line: int, row: str, inputs: Sequence[Variable], outputs: Sequence[Variable], fuzzylite: bool) -> list[Rule]:
    match = _RULE.fullmatch(row)
    if not match:
        refuse(line, f"{row!r}, expected a rule such as 1 -2, 1 (1) : 1")
    asked, concluded, weight, connective = match.groups()
    if connective not in ("1", "2"):
        refuse(line, f"{row!r} ends in {connective!r}, expected 1 for and, 2 for or")
    condition: list[Proposition] = []
    for (index, negated, hedges), v in zip(_indices(asked, line, row, inputs, fuzzylite), inputs, strict=True):
        statement = _statement(index, hedges, v)
        if statement is not None:
            condition.append(Not(statement) if negated else statement)
    conclusions: list[tuple[tuple[str, ...], Is]] = []
    for (index, negated, hedges), v in zip(_indices(concluded, line, row, outputs, fuzzylite), outputs, strict=True):
        if negated:
            refuse(line, f"{row!r} concludes that {v.name!r} is not in a term, which is not known here")
        if hedges and not fuzzylite:
            refuse(line, f"{row!r} has a hedge in the conclusion on {v.name!r}, which only fuzzylite's files may have")
        if index:
            conclusions.append((hedges, Is(v.name, v.terms[index - 1].name)))
    if not condition or not conclusions:
        refuse(line, f"{row!r} has no {'conclusion' if condition else 'condition'}, expected one number that is not 0")
    joined = condition[0] if len(condition) == 1 else (And if connective == "1" else Or)(tuple(condition))
    share = read_number(weight.strip(), line, "weight")
    if share != 1.0 and any(hedges for hedges, _ in conclusions):
        refuse(line, f"{row!r} has a hedge in a conclusion and a weight, expected the weight 1")
    return bent_rules(joined, conclusions, share)


def _statement(index: int, hedges: tuple[str, ...], v: Variable) -> Proposition | None:
    if hedges == ("any",):
        return Anything(v.name)
    if not index:
        return None
    statement: Proposition = Is(v.name, v.terms[index - 1].name)
    for hedge in reversed(hedges):
        statement = Hedged(hedge, statement)
    return statement


def _indices(
    text: str, line: int, row: str, variables: Sequence[Variable], fuzzylite: bool
) -> list[tuple[int, bool, tuple[str, ...]]]:
    """Return of each variable the number of its term from 1, whether it is negated, and its hedges."""
    parts = text.split()
    if len(parts) != len(variables):
        refuse(line, f"{row!r} has {len(parts)} numbers in {text.strip()!r}, expected {len(variables)}")
    indices = []
    for part, v in zip(parts, variables, strict=True):
        whole = re.fullmatch(r"(-?)([0-9]{1,9})(?:\.([0-9]*?)0*)?", part, re.ASCII)  # fuzzylite writes 1.000
        index = int(whole[2]) if whole else -1
        hedges = (HEDGES if fuzzylite else OCTAVE_HEDGES).get(whole[3] or "") if whole else None
        if whole is None or index > len(v.terms) or hedges is None or (hedges and not index and hedges != ("any",)):
            expected = f"a whole number from {-len(v.terms)} to {len(v.terms)}, or .05, .2 or .4 more for a hedge"
            refuse(line, f"{row!r}: {part} for {v.name!r}, expected {expected}")
        indices.append((index, whole[1] == "-", hedges))
    return indices
