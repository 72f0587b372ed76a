"""Settings that FCL, FIS and FLL cannot represent: one comment that this package reads back, and others for people."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Sequence
from typing import Any

from fuzzy_arbiter.definition import CHOICES, Output, System
from fuzzy_arbiter.errors import UnsupportedError
from fuzzy_arbiter.formats.native import range_ends
from fuzzy_arbiter.formats.notation import format_number, refuse

MARK = "fuzzy_arbiter:"
# settings of a file without such a comment
PLAIN: dict[str, Any] = {"normalization": "none", "outside": "refuse", "points": 101}
_NAMES = "weights_of"
_PART = re.compile(r'(?:[^,"]|"[^"]*"|")+')  # between commas outside of quotes


def settings_of(outputs: Sequence[Output]) -> tuple[str, ...]:
    """Return the settings of a system that FLL cannot represent."""
    return ("normalization", "points") if all(output.weighted for output in outputs) else ("normalization",)


def format_settings(system: System, keys: Sequence[str] = tuple(PLAIN)) -> list[str]:
    """Format the comments that a system needs."""
    pairs = [f"{key} = {getattr(system, key)}" for key in keys if getattr(system, key) != PLAIN[key]]
    if system.weights_of:
        pairs.append(f"{_NAMES} = {' '.join(map(_quoted, system.weights_of))}")
    texts = [f"{MARK} {', '.join(pairs)}"] if pairs else []
    if system.normalization == "none":
        return texts
    texts.append("other tools give the raw centroid c of each output; the weights are")
    for output in system.outputs:
        low, high = map(float, range_ends(output))
        zero, scale = format_number(low), format_number(high - low)
        texts.append(f"  (c - {zero}) / {scale}, held within [0, 1], for {output.name}")
    if system.normalization in ("sum", "max"):
        whole = "sum" if system.normalization == "sum" else "greatest"
        texts.append(f"  and then each divided by the {whole} of all, unless that is 0")
    return texts


def read_settings(comments: Iterable[tuple[int, str]], keys: Sequence[str] = tuple(PLAIN)) -> dict[str, Any]:
    """Parse the settings in the comments of a file."""
    settings = {**{key: PLAIN[key] for key in keys}, _NAMES: ()}
    first, known_keys = 0, set[str]()
    for line, text in comments:
        if not text.strip().startswith(MARK):
            word = re.match(r"\s*([\w-]*)", text)
            if word and difflib.SequenceMatcher(None, word[1][:100].lower(), MARK[:-1]).ratio() > 0.8:
                refuse(line, f"{text.strip()!r} is almost such a comment, expected {MARK!r} or another first word")
            continue
        if first:
            refuse(line, f"{text.strip()!r} is the second such comment after line {first}, expected one")
        first = line
        for part in _PART.findall(text.strip().removeprefix(MARK)) or [""]:
            key, equals, value = (s.strip() for s in part.partition("="))
            if key not in settings or not equals or key in known_keys:
                refuse(line, f"{part.strip()!r}, expected each once, with = and its value: {', '.join(settings)}")
            known_keys.add(key)
            settings[key] = _value(key, value, line)
    return settings


def _quoted(name: str) -> str:
    if "*)" in name or "(*" in name:
        raise UnsupportedError(f"weights_of: {name!r} would end a comment, expected a name without (* and *)")
    return f'"{name}"'


def _value(key: str, value: str, line: int) -> Any:
    if key == _NAMES:
        if not re.fullmatch(r'"[^"]+"(\s+"[^"]+")*', value):
            refuse(line, f"{key} is {value!r}, expected names in double quotes, with spaces between them")
        return tuple(re.findall(r'"([^"]+)"', value))
    if key == "points":
        if not re.fullmatch(r"\d{1,4000}", value, re.ASCII):
            refuse(line, f"points is {value!r}, expected a whole number, 3 or more")
        return int(value)
    if value not in CHOICES[key]:
        refuse(line, f"{key} is {value!r}, expected one of {', '.join(CHOICES[key])}")
    return value
