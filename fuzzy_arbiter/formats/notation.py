"""Common parts of the formats: numbers without loss, names, and errors with a line."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from typing import NoReturn

from fuzzy_arbiter.definition import System
from fuzzy_arbiter.errors import DefinitionError, FormatError, UnsupportedError
from fuzzy_arbiter.propositions import KEYWORDS
from fuzzy_arbiter.rule import Rule

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


def read_number(text: str, line: int, what: str, infinite: bool = False) -> float:
    """Parse a text as a finite number, or as an infinite one where that is allowed."""
    if infinite and re.fullmatch("[+-]?inf", text, re.IGNORECASE):
        return float(text)
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


def require_words(
    system: System, format: str, reserved: frozenset[str], functions: Collection[str] = (), others: Iterable[str] = ()
) -> None:
    """Require that a format accepts the names of a system's variables and terms, and some others."""
    for name in (*others, *(name for v in (*system.inputs, *system.outputs) for name in (v.name, *v.term_names))):
        if not re.fullmatch(r"[^\W\d_]\w*", name, re.ASCII if format == "fcl" else 0):
            expected = "expected letters, digits and _, a letter first"
            raise UnsupportedError(f"{format} cannot express the name {name!r}: {expected}")
        if name.lower() in {*KEYWORDS, *reserved} or name in functions:
            raise UnsupportedError(f"{format} cannot express the name {name!r}: it is a word of the language")


def unsupported_rule(format: str, i: int, rule: Rule, expected: str, what: str = "condition") -> UnsupportedError:
    """Return the error for a rule that a format cannot represent."""
    return UnsupportedError(f"{format} cannot express the {what} of R{i + 1} {str(rule)!r}: expected {expected}")
