"""What the formats share: numbers without loss, names, faults that say where, and the system put together."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NoReturn

from fuzzy_arbiter.definition import Output, System, Variable
from fuzzy_arbiter.errors import DefinitionError, FormatError, UnsupportedError
from fuzzy_arbiter.propositions import is_identifier
from fuzzy_arbiter.rule import Operators, Rule

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)


def say_number(x: float) -> str:
    """Return the shortest text that reads as the same number again.

    Parameters
    ----------
    x : float
        Finite.

    Returns
    -------
    str
        With a point or an exponent unless it is a whole number; an exponent follows a point, as IEC 61131-3 wants it.
    """
    text = repr(float(x))
    if "e" in text and "." not in text:
        return text.replace("e", ".0e")
    return text.removesuffix(".0")


def say_numbers(xs: Iterable[float]) -> str:
    """Return numbers with spaces between them.

    Parameters
    ----------
    xs : iterable of float
        Finite.

    Returns
    -------
    str
        Each as of `say_number`.
    """
    return " ".join(map(say_number, xs))


def read_number(text: str, line: int, what: str) -> float:
    """Return the number that a text says.

    Parameters
    ----------
    text : str
        Digits, with or without sign, point and exponent.
    line : int
        Where it stands, for the fault.
    what : str
        What it is, for the fault.

    Returns
    -------
    float
        Finite.

    Raises
    ------
    FormatError
        If it is no number, or not finite.
    """
    x = float(text) if _NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(x):
        refuse(line, f"{what} is {text!r}, expected a finite number")
    return x


def refuse(line: int, what: str) -> NoReturn:
    """Raise the fault that a line has.

    Parameters
    ----------
    line : int
        Its number, from 1.
    what : str
        The offending text, and what was expected.

    Raises
    ------
    FormatError
        Always.
    """
    raise FormatError(f"line {line}: {shortened(what)}")


def shortened(text: str) -> str:
    """Return a text without its middle if it is long.

    Parameters
    ----------
    text : str
        Part of a fault, which may quote a long line.

    Returns
    -------
    str
        At most 400 characters.
    """
    return text if len(text) <= 400 else f"{text[:250]} ... {text[-140:]}"


@contextmanager
def located(where: str) -> Iterator[None]:
    """Say where in the file a definition stands that cannot be.

    Parameters
    ----------
    where : str
        Such as ``line 7`` or a key's path.

    Raises
    ------
    DefinitionError
        With the place before its text.
    """
    try:
        yield
    except DefinitionError as error:
        raise type(error)(f"{shortened(where)}: {shortened(str(error))}") from None


def assembled(
    line: int,
    inputs: Sequence[Variable],
    outputs: Sequence[Output],
    rules: Sequence[tuple[int, Rule]],
    **options: Any,
) -> System:
    """Return the system of a file.

    Parameters
    ----------
    line : int
        Where the system begins.
    inputs, outputs
        As of `System`.
    rules : sequence of (int, Rule)
        Each with the line where it stands.
    **options
        The other attributes of `System`.

    Returns
    -------
    System
        Of these.

    Raises
    ------
    DefinitionError
        If it cannot be; the line is named, for a rule its own.
    """
    try:
        return System(tuple(inputs), tuple(outputs), tuple(rule for _, rule in rules), **options)
    except DefinitionError as error:
        fault = re.match(r"R(\d+) ", str(error))
        where = rules[int(fault[1]) - 1][0] if fault else line
        raise type(error)(f"line {where}: {shortened(str(error))}") from None


def require_words(system: System, format: str, reserved: frozenset[str]) -> None:
    """Refuse a system with names that are no words of a format.

    Parameters
    ----------
    system : System
        What is to be written.
    format : str
        Name of the format.
    reserved : frozenset of str
        Words, in lower case, that mean something in the format.

    Raises
    ------
    UnsupportedError
        If a name of a variable or term is no identifier, or is reserved.
    """
    for variable in (*system.inputs, *system.outputs):
        for name in (variable.name, *variable.term_names):
            require_word(name, format, reserved)


def require_word(name: str, format: str, reserved: frozenset[str]) -> None:
    """Refuse a name that is no word of a format.

    Parameters
    ----------
    name : str
        Name of a system, variable or term.
    format, reserved
        As of `require_words`.

    Raises
    ------
    UnsupportedError
        If it is no identifier, or is reserved.
    """
    if not is_identifier(name) or name.startswith("_"):
        raise UnsupportedError(f"{format} cannot say the name {name!r}: expected letters, digits and _, a letter first")
    if name.lower() in reserved:
        raise UnsupportedError(f"{format} cannot say the name {name!r}: it is a word of the language")


def cannot_say(format: str, i: int, rule: Rule, expected: str, what: str = "condition") -> UnsupportedError:
    """Return the error for a rule that a format cannot say.

    Parameters
    ----------
    format : str
        Name of the format.
    i : int
        Number of the rule, from 0.
    rule : Rule
        The rule, which is quoted.
    expected : str
        What the format can say instead.
    what : str
        Which part of the rule it is.

    Returns
    -------
    UnsupportedError
        To be raised.
    """
    return UnsupportedError(f"{format} cannot say the {what} of R{i + 1} {shortened(str(rule))!r}: expected {expected}")


def blocks(system: System) -> list[tuple[Operators, list[tuple[int, Rule]]]]:
    """Return a system's rules in blocks of the same operators.

    Parameters
    ----------
    system : System
        What is to be written.

    Returns
    -------
    list of (Operators, list of (int, Rule))
        In the rules' order; each rule with its number from 0.
    """
    own = Operators(system.conjunction, system.disjunction, system.implication)
    result: list[tuple[Operators, list[tuple[int, Rule]]]] = []
    for i, rule in enumerate(system.rules):
        operators = rule.operators or own
        if not result or result[-1][0] != operators:
            result.append((operators, []))
        result[-1][1].append((i, rule))
    return result
