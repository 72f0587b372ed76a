"""Read MATLAB's text."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from fuzzy_arbiter.definition import WEIGHTED, Output, System, Variable
from fuzzy_arbiter.errors import FormatError
from fuzzy_arbiter.formats.fis_rules import read_rules, with_complements
from fuzzy_arbiter.formats.fis_terms import numbers_of, read_function, with_unique_names
from fuzzy_arbiter.formats.fis_words import (
    DEFUZZIFIERS,
    FUZZYLITE_KEYS,
    METHODS,
    SETTINGS,
    TYPES,
)
from fuzzy_arbiter.formats.notation import assembled, located, read_number, refuse
from fuzzy_arbiter.formats.settings import read_settings
from fuzzy_arbiter.rule import Rule
from fuzzy_arbiter.shapes import Membership
from fuzzy_arbiter.terms.term import Term
from fuzzy_arbiter.terms.values import Formula

_SECTION = re.compile(r"\[\s*(System|Input|Output|Rules)\s*([1-9][0-9]{0,8})?\s*\]", re.ASCII)
_ENTRY = re.compile(r"(\w+)\s*=\s*(.*)", re.ASCII)
_QUOTED = re.compile(r"'([^']*)'")
_LIST = re.compile(r"\[([^][]*)\]")
_FUNCTION = re.compile(r"'([^']*)'\s*:\s*'([^']*)'\s*,\s*\[([^][]*)\]")
_COUNTS = ("NumInputs", "NumOutputs", "NumRules")
_SYSTEM_KEYS = ("Name", "Type", "Version", *_COUNTS, *METHODS, "DefuzzMethod")


@dataclass
class _Section:
    """The lines of one section: entries by key, and lines that are not entries."""

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

    def flag(self, key: str) -> bool:
        line, value = self.entries.get(key, (self.line, "0"))
        return value == "1" if value in ("0", "1") else refuse(line, f"{key} is {value}, expected 0 or 1")

    def default(self) -> float | None:
        line, value = self.entries.get("Default", (self.line, "nan"))
        return None if value == "nan" else read_number(value, line, "Default")

    def require_count(self, key: str, count: int) -> None:
        line, value = self.entries.get(key, (self.line, ""))
        if value != str(count):
            refuse(line, f"{key} is {value or 'missing'}, expected {count}, since there are {count}")


def read(text: str) -> System:
    """Parse MATLAB's text as a system."""
    # Terms of one name are numbered, as rules speak of them by their place. Where a rule concludes that an output is
    # not in a term, its complement becomes a term of its own. The strengths of rules that conclude one value are added,
    # whatever AggMethod says, as MATLAB does it; where a comment names the fuzzy-logic-toolkit, they are joined as
    # AggMethod defines, as in Octave.
    sections, comments = _sections(text)
    settings = read_settings(comments, SETTINGS)
    if "System" not in sections or "Rules" not in sections:
        raise FormatError("expected the sections [System] and [Rules] of a FIS file, among others")
    system = sections["System"]
    norms, defuzzifier, name = _norms(system), _defuzzifier(system), system.string("Name")
    aggregation = norms.pop("aggregation")
    fuzzylite = any("generated with fuzzylite" in text for _, text in comments) or any(
        key in FUZZYLITE_KEYS for section in sections.values() for key in section.entries
    )
    inputs = [Variable(*parts) for parts in _variables(sections, "Input", None)]
    values = aggregation if any("fuzzy-logic-toolkit" in text for _, text in comments) else "sum"
    outputs = _outputs(sections, len(inputs), defuzzifier, aggregation, values)
    counted = {"NumInputs": len(inputs), "NumOutputs": len(outputs), "NumRules": len(sections["Rules"].rows)}
    for key, count in counted.items():
        system.require_count(key, count)
    rules: list[tuple[int, Rule]] = []
    for line, row in sections["Rules"].rows:
        with located(f"line {line}: {row!r}"):
            rules += [(line, rule) for rule in read_rules(line, row, inputs, outputs, fuzzylite)]
    outputs = [with_complements(output, rules) for output in outputs]
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
                refuse(line, f"section {content!r} appears twice")
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
                refuse(line, f"{entry[1]} appears twice in [{section.name}]")
            section.entries[entry[1]] = line, entry[2]
    return sections, comments


def _norms(system: _Section) -> dict[str, str]:
    for key, (line, _) in system.entries.items():
        if key not in _SYSTEM_KEYS:
            refuse(line, f"{key} is not known in [System], expected one of {', '.join(_SYSTEM_KEYS)}")
    norms: dict[str, str] = {}
    for key, known in METHODS.items():
        value = system.string(key)
        if value is not None and value not in known:
            refuse(
                system.entries[key][0],
                f"{key} is {value!r}, which is not known here; expected {' or '.join(filter(None, known))}",
            )
        norms[key] = known[value or ""]
    if not system.string("AndMethod") and norms["OrMethod"] == "probor":
        norms["AndMethod"] = "prod"
    return {
        "conjunction": norms["AndMethod"],
        "disjunction": norms["OrMethod"],
        "implication": norms["ImpMethod"],
        "aggregation": norms["AggMethod"],
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
            refuse(found[-1].line, f"got [{found[-1].name}] without [{kind}{k}]; expected them numbered from 1")
        variables.append(_variable(section, inputs))
    return variables


def _outputs(
    sections: dict[str, _Section], inputs: int, defuzzifier: str, aggregation: str, of_values: str
) -> list[Output]:
    outputs: list[Output] = []
    for k, parts in enumerate(_variables(sections, "Output", inputs), 1):
        values = any(not isinstance(term.shape, Membership) or isinstance(term.shape, Formula) for term in parts[2])
        own = "average" if values and defuzzifier not in WEIGHTED and _hybrid(sections) else defuzzifier
        join = of_values if own in WEIGHTED else aggregation
        section = sections[f"Output{k}"]
        locks = section.flag("LockRange"), section.flag("LockPrevious")
        with located(f"line {section.line}"):
            outputs.append(Output(*parts, section.default(), own, join, *locks))  # type: ignore[arg-type]  # words from a table
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
    if "Enabled" in section.entries and not section.flag("Enabled"):
        refuse(section.entries["Enabled"][0], f"Enabled is 0 for {name!r}, expected 1")
    known = ("Name", "Range", "NumMFs", *(FUZZYLITE_KEYS if inputs is not None else FUZZYLITE_KEYS[:1]))
    functions = {key: entry for key, entry in section.entries.items() if key not in known}
    section.require_count("NumMFs", len(functions))
    terms: list[Term] = []
    for j, (key, (line, value)) in enumerate(functions.items(), 1):
        if key != f"MF{j}":
            refuse(line, f"got {key} in [{section.name}], expected MF{j}")
        match = _FUNCTION.fullmatch(value)
        if not match:
            refuse(line, f"{value}, expected a membership function such as 'low':'trimf',[-1 0 1]")
        term, function, places = match.groups()
        with located(f"line {line}: term {term!r}"):
            terms.append(Term(term, read_function(function, places, line, term, inputs)))
    parts = name, (bounds[0], bounds[1]), with_unique_names(terms)
    with located(f"line {section.line}"):
        if inputs is None:
            Variable(*parts)
    return parts
