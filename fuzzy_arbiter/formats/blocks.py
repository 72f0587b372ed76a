"""Sections of files as keys and values, and the assembly of a system from them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, TypeVar

from fuzzy_arbiter.definition import Output, System, Variable
from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.formats.notation import located, read_number, refuse
from fuzzy_arbiter.rule import Operators, Rule

T = TypeVar("T")

NumberedRule = tuple[int, Rule]  # line in the file, and rule
RuleBlock = tuple[Operators, list[NumberedRule]]


@dataclass
class Block:
    """A section of a file, a variable or a block of rules, as keys and values."""

    kind: str
    name: str
    line: int
    entries: dict[str, tuple[int, str]] = field(default_factory=dict)  # line and value by key
    many: list[tuple[int, str]] = field(default_factory=list)  # line and value of terms or rules

    @property
    def title(self) -> str:
        """Kind and name, for messages."""
        return f"{self.kind} {self.name!r}" if self.name else self.kind

    def add(self, line: int, key: str, value: str, known: Sequence[str] = (), many: Sequence[str] = ()) -> None:
        """Add an entry; refuse a key that is not known, or that appears twice without being one of many."""
        if known and key not in known:
            refuse(line, f"{key!r} is not known in {self.kind}, expected one of {', '.join(known)}")
        if key in many:
            self.many.append((line, value))
        elif key in self.entries:
            refuse(line, f"{key} appears twice in {self.title}")
        else:
            self.entries[key] = line, value

    def entry(self, key: str, missing: str = "") -> tuple[int, str]:
        """Return the line and the value of a key."""
        return self.entries.get(key, (self.line, missing))

    def word(self, key: str, known: dict[str, Any], missing: str = "") -> Any:
        """Look up the word of a key in `known`; refuse another word."""
        line, value = self.entry(key, missing)
        if value not in known:
            expected = " or ".join(word for word in known if word)
            refuse(line, f"{key} of {self.title} is {value or 'missing'}, expected {expected}")
        return known[value]

    def number(self, key: str) -> float | None:
        """Parse the number of a key; None for `nan`, and where it is missing."""
        line, value = self.entry(key, "nan")
        return None if value == "nan" else read_number(value, line, f"{key} of {self.title}")

    def build(self, make: Callable[..., T], *arguments: Any) -> T:
        """Make the variable that the block defines."""
        try:
            return make(*arguments)
        except DefinitionError as error:
            message = str(error).replace("universe", "range")
            lines = [line for key, (line, _) in self.entries.items() if f" {key.lower()} is " in message]
            terms = [(line, repr(text.split(" ")[0])) for line, text in self.many]
            lines = lines or [line for line, name in terms if f"term {name}" in message or f"named {name}" in message]
            raise type(error)(f"line {lines[-1] if lines else self.line}: {error}") from None

    def rules(self, parse: Callable[[int, str], Iterable[Rule]]) -> list[NumberedRule]:
        """Parse the block's rules."""
        rules: list[NumberedRule] = []
        for line, text in self.many:
            with located(f"line {line}"):
                rules += [(line, rule) for rule in parse(line, text)]
        return rules


def assemble(
    line: int, inputs: Iterable[Variable], outputs: Iterable[Output], blocks: Sequence[RuleBlock], **options: Any
) -> System:
    """Build the system of a file, with the operators of its first block of rules; other blocks keep their own."""
    first = blocks[0][0] if blocks else Operators()
    lines, rules = [], []
    for operators, numbered in blocks:
        lines += [number for number, _ in numbered]
        rules += [rule if operators == first else replace(rule, operators=operators) for _, rule in numbered]
    try:
        return System(tuple(inputs), tuple(outputs), tuple(rules), **asdict(first), **options)
    except DefinitionError as error:
        fault = re.match(r"R(\d+) ", str(error))
        raise type(error)(f"line {lines[int(fault[1]) - 1] if fault else line}: {error}") from None


def group_rules(system: System) -> list[RuleBlock]:
    """Group a system's rules, each with its index, into blocks with the same operators."""
    own = Operators(system.conjunction, system.disjunction, system.implication)
    result: list[RuleBlock] = []
    for i, rule in enumerate(system.rules):
        operators = rule.operators or own
        if not result or result[-1][0] != operators:
            result.append((operators, []))
        result[-1][1].append((i, rule))
    return result
