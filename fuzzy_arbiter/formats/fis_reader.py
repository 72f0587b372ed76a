"""Reads MATLAB's text."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from fuzzy_arbiter.definition import Output, System, Term, Variable
from fuzzy_arbiter.errors import FormatError
from fuzzy_arbiter.formats.fis_words import FUNCTIONS, METHODS, SETTINGS
from fuzzy_arbiter.formats.notation import assembled, located, read_number, refuse
from fuzzy_arbiter.formats.settings import read_settings
from fuzzy_arbiter.propositions import And, Is, Not, Or, Proposition
from fuzzy_arbiter.rule import Rule

_SECTION = re.compile(r"\[\s*(System|Input|Output|Rules)\s*([1-9][0-9]{0,8})?\s*\]", re.ASCII)
_ENTRY = re.compile(r"(\w+)\s*=\s*(.*)", re.ASCII)
_QUOTED = re.compile(r"'([^']*)'")
_LIST = re.compile(r"\[([^][]*)\]")
_FUNCTION = re.compile(r"'([^']*)'\s*:\s*'([^']*)'\s*,\s*\[([^][]*)\]")
_RULE = re.compile(r"([^,()]*),([^,()]*)\(([^()]*)\)\s*:\s*(\S+)")
_SYSTEM_KEYS = ("Name", "Version", "NumInputs", "NumOutputs", "NumRules", *METHODS)


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

    Parameters
    ----------
    text : str
        Of a Mamdani system.

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
    norms, name = _head(system), system.string("Name")
    inputs, outputs = _variables(sections, "Input"), _variables(sections, "Output")
    system.require_count("NumInputs", len(inputs))
    system.require_count("NumOutputs", len(outputs))
    system.require_count("NumRules", len(sections["Rules"].rows))
    rules: list[tuple[int, Rule]] = []
    for line, row in sections["Rules"].rows:
        with located(f"line {line}: {row!r}"):
            rules.append((line, _rule(line, row, inputs, outputs)))
    made = [Output(v.name, v.universe, v.terms) for v in outputs]
    return assembled(system.line, inputs, made, rules, name=name or "arbiter", **norms, **settings)


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


def _head(system: _Section) -> dict[str, str]:
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
        said[key] = next(iter(known.values())) if value is None else known[value]
    return {"conjunction": said["AndMethod"], "disjunction": said["OrMethod"], "implication": said["ImpMethod"]}


def _variables(sections: dict[str, _Section], kind: str) -> list[Variable]:
    found = [s for name, s in sections.items() if name.startswith(kind)]
    variables: list[Variable] = []
    for k in range(1, len(found) + 1):
        section = sections.get(f"{kind}{k}")
        if section is None:
            refuse(found[-1].line, f"[{found[-1].name}] came, and no [{kind}{k}]; expected them numbered from 1")
        variables.append(_variable(section))
    return variables


def _variable(section: _Section) -> Variable:
    name = section.string("Name")
    if name is None or "Range" not in section.entries:
        refuse(section.line, f"[{section.name}] without {'Name' if name is None else 'Range'}")
    line, value = section.entries["Range"]
    match = _LIST.fullmatch(value)
    bounds = _numbers(match[1], line, "Range") if match else []
    if len(bounds) != 2:
        refuse(line, f"Range is {value}, expected two numbers in brackets")
    functions = {key: entry for key, entry in section.entries.items() if key not in ("Name", "Range", "NumMFs")}
    section.require_count("NumMFs", len(functions))
    terms: list[Term] = []
    for j, (key, (line, value)) in enumerate(functions.items(), 1):
        if key != f"MF{j}":
            refuse(line, f"{key} came in [{section.name}], expected MF{j}")
        terms.append(_term(line, value))
    with located(f"line {section.line}"):
        make = Output if section.name.startswith("Output") else Variable
        return make(name, (bounds[0], bounds[1]), tuple(terms))


def _term(line: int, value: str) -> Term:
    match = _FUNCTION.fullmatch(value)
    if not match:
        refuse(line, f"{value}, expected a membership function such as 'low':'trimf',[-1 0 1]")
    name, function, places = match.groups()
    if function not in FUNCTIONS:
        refuse(line, f"term {name!r} is {function!r}, which is not known here; expected {', '.join(FUNCTIONS)}")
    count, make = FUNCTIONS[function]
    numbers = _numbers(places, line, f"place of {name!r}")
    padding = numbers[count:]
    if len(numbers) < count or (padding and (count, padding) != (3, [0.0])):  # MATLAB's old files fill all up to four
        refuse(line, f"term {name!r} has the places [{places}], expected {count} for {function}")
    with located(f"line {line}: term {name!r}"):
        return Term(name, make(*numbers[:count]))


def _numbers(text: str, line: int, what: str) -> list[float]:
    return [read_number(part, line, what) for part in re.split(r"[\s,;]+", text.strip()) if part]


def _rule(line: int, row: str, inputs: Sequence[Variable], outputs: Sequence[Variable]) -> Rule:
    match = _RULE.fullmatch(row)
    if not match:
        refuse(line, f"{row!r}, expected a rule such as 1 -2, 1 (1) : 1")
    asked, concluded, weight, connective = match.groups()
    if connective not in ("1", "2"):
        refuse(line, f"{row!r} ends in {connective!r}, expected 1 for and, 2 for or")
    condition: list[Proposition] = []
    for index, v in zip(_indices(asked, line, row, inputs), inputs, strict=True):
        if index:
            statement = Is(v.name, v.terms[abs(index) - 1].name)
            condition.append(Not(statement) if index < 0 else statement)
    conclusions: list[Is] = []
    for index, v in zip(_indices(concluded, line, row, outputs), outputs, strict=True):
        if index < 0:
            refuse(line, f"{row!r} concludes that {v.name!r} is not in a term, which is not known here")
        if index:
            conclusions.append(Is(v.name, v.terms[index - 1].name))
    if not condition or not conclusions:
        refuse(line, f"{row!r} has no {'conclusion' if condition else 'condition'}, expected one number that is not 0")
    joined = condition[0] if len(condition) == 1 else (And if connective == "1" else Or)(tuple(condition))
    return Rule(joined, tuple(conclusions), read_number(weight.strip(), line, "weight"))


def _indices(text: str, line: int, row: str, variables: Sequence[Variable]) -> list[int]:
    parts = text.split()
    if len(parts) != len(variables):
        refuse(line, f"{row!r} has {len(parts)} numbers in {text.strip()!r}, expected {len(variables)}")
    indices: list[int] = []
    for part, v in zip(parts, variables, strict=True):
        whole = re.fullmatch(r"(-?[0-9]{1,9})(?:\.0*)?", part)  # fuzzylite writes 1.000
        if not whole or abs(int(whole[1])) > len(v.terms):
            refuse(
                line, f"{row!r}: {part} for {v.name!r}, expected a whole number from {-len(v.terms)} to {len(v.terms)}"
            )
        indices.append(int(whole[1]))
    return indices
