"""Verbs with their help, and the flags that several verbs share."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from cosim.errors import RunError

_MAX_QUOTED = 40  # maximum number of characters of a refused text in the message

# of a flag that takes several values and may be repeated
LIST: dict[str, Any] = {"nargs": "+", "action": "extend", "default": []}

Container = argparse._ActionsContainer  # a parser, or a group of its flags


def add_verb(
    verbs: Any, name: str, call: Callable[[argparse.Namespace], int], summary: str, page: str, examples: Sequence[str]
) -> argparse.ArgumentParser:
    """Add a verb that runs `call`; its help has the summary, examples, and the page of docs/ that explains it."""
    example_lines = "".join(f"  cosim {example}\n" for example in examples)
    verb: argparse.ArgumentParser = verbs.add_parser(
        name,
        help=summary,
        description=f"{summary[0].upper()}{summary[1:]}.",
        epilog=f"examples:\n{example_lines}\nmore: docs/{page}.md",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    verb.set_defaults(call=call)
    return verb


def flag(
    verb: Container, name: str, meaning: str, convert: Callable[[str], Any] = str, default: Any = None, **more: Any
) -> None:
    """Add a flag such as ``--rate HZ``, or a switch such as ``--json``; its help states the default."""
    option, *metavar = name.split()
    if not metavar and "choices" not in more:
        verb.add_argument(option, action="store_true", help=meaning, **more)
        return
    if default not in (None, []):
        meaning += f" (default: {f'{default:g}' if isinstance(default, int | float) else default})"
    one = metavar[0] if metavar else None
    verb.add_argument(
        option, type=convert, default=default, help=meaning, metavar=tuple(metavar) if metavar[1:] else one, **more
    )


def refuse_flags(options: argparse.Namespace, names: Sequence[str], expected: str) -> None:
    """Raise a RunError for the first of some flags that is given."""
    for name in names:
        value = getattr(options, name)
        if not (value is None or value is False or value == []):
            raise RunError(f"--{name.replace('_', '-')}: expected {expected}")


def add_scenario(verb: Container, **more: Any) -> None:
    """Add the scenario as an argument."""
    verb.add_argument("scenario", help="a shipped name (cosim show lists them), or a TOML file", **more)


def add_changes(verb: Container, what: str = "a key of the scenario, such as law.gains.k_p1=10") -> None:
    """Add the flag that changes keys of the scenario, or gains of a law."""
    flag(verb, "--set KEY=VALUE", f"set {what}; may be repeated", action="append", default=[])


def add_run_folder(verb: Container) -> None:
    """Add the flags for the folder of a run, and for its report."""
    flag(verb, "--out DIR", "run folder (default: runs/SCENARIO-TIME)", Path)
    flag(verb, "--no-report", "leave out the report, its figures and the replay")


def add_remote(verb: Container) -> None:
    """Add the flags for the access to a link."""
    flag(verb, "--allow-remote", "let the link leave this machine")
    flag(verb, "--signing-key FILE", "sign with the key in this file, and accept only messages signed with it", Path)


# ---- types of numbers within bounds ----------------------------------------------------------------------------------


def int_range(low: int, high: int) -> Callable[[str], int]:
    """Make the type of a flag that takes a whole number from low to high."""

    def parse(text: str) -> int:
        digits = text.isascii() and text.isdecimal() and len(text) <= len(str(high))
        if digits and low <= int(text) <= high:
            return int(text)
        raise argparse.ArgumentTypeError(f"{text[:_MAX_QUOTED]!r}: expected a whole number from {low} to {high}")

    return parse


def float_range(low: float, high: float) -> Callable[[str], float]:
    """Make the type of a flag that takes a number from low to high, in units of the flag."""

    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if low <= value <= high:
            return value
        raise argparse.ArgumentTypeError(f"{text[:_MAX_QUOTED]!r}: expected a number from {low:g} to {high:g}")

    return parse


def rate(text: str) -> float:
    """Parse a rate in simulated seconds per second; ``max`` is infinity."""
    try:
        return math.inf if text == "max" else float_range(1e-3, 1e6)(text)
    except argparse.ArgumentTypeError as error:
        raise argparse.ArgumentTypeError(f"{error}, or max") from None
