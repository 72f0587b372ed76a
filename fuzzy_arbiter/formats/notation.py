"""Common parts of the formats: numbers without loss, names, errors with a line, and the assembly of a system."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from typing import Any, NoReturn, TypeVar

from fuzzy_arbiter.definition import Output, System, Variable
from fuzzy_arbiter.errors import DefinitionError, FormatError, UnsupportedError
from fuzzy_arbiter.propositions import is_identifier
from fuzzy_arbiter.rule import Operators, Rule

T = TypeVar("T")

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)


def format_number(x: float) -> str:
    """Format a number as the shortest text that parses as the same number."""
    text = repr(float(x))
    if "e" in text and "." not in text:
        return text.replace("e", ".0e")
    return text.removesuffix(".0")


def format_numbers(xs: Iterable[float]) -> str:
    """Format numbers with spaces between them."""
    return " ".join(map(format_number, xs))


def read_number(text: str, line: int, what: str) -> float:
    """Parse a text as a finite number."""
    x = float(text) if _NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(x):
        refuse(line, f"{what} is {text!r}, expected a finite number")
    return x


def refuse(line: int, what: str) -> NoReturn:
    """Raise the error of a line."""
    raise FormatError(f"line {line}: {what}")


@contextmanager
def located(where: str) -> Iterator[None]:
    """Add the place in the file to the text of a `DefinitionError`."""
    try:
        yield
    except DefinitionError as error:
        raise type(error)(f"{where}: {error}") from None


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


def assembled(
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


def require_words(system: System, format: str, reserved: frozenset[str], functions: Collection[str] = ()) -> None:
    """Require that a format accepts the names of a system's variables and terms."""
    for variable in (*system.inputs, *system.outputs):
        for name in (variable.name, *variable.term_names):
            require_word(name, format, reserved, functions)


def require_word(name: str, format: str, reserved: frozenset[str], functions: Collection[str] = ()) -> None:
    """Require that a format accepts a name."""
    if not is_identifier(name) or name.startswith("_"):
        raise UnsupportedError(f"{format} cannot say the name {name!r}: expected letters, digits and _, a letter first")
    if name.lower() in reserved or name in functions:
        raise UnsupportedError(f"{format} cannot say the name {name!r}: it is a word of the language")


def unsupported_rule(format: str, i: int, rule: Rule, expected: str, what: str = "condition") -> UnsupportedError:
    """Return the error for a rule that a format cannot represent."""
    return UnsupportedError(f"{format} cannot say the {what} of R{i + 1} {str(rule)!r}: expected {expected}")


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
