"""Keys of a scenario as text: parts with dots between them, and TOML's quotes around parts that have blanks."""

from __future__ import annotations

import re
import tomllib

from cosim.errors import ScenarioError

_QUOTED = r'"(?:[^"\\]|\\.)*"|\'[^\']*\''
_PART = re.compile(rf"\s*({_QUOTED}|[^.\"']*)\s*(\.|$)")
_CHANGE = re.compile(rf"((?:{_QUOTED}|[^=\"'])*)=(.*)", re.S)
_SHOWN = 80  # greatest number of characters quoted in a message


def shorten(text: str) -> str:
    """Cut a text for a message."""
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]} ..."


def plain_key(text: str) -> str:
    """Remove the quotes from a key, such as ``regions."my rock".gain``: no name within a key needs them.

    Raises
    ------
    ScenarioError
        If a quote does not end, or stands within a part.
    """
    parts, offset, dot = [], 0, "."
    while dot:
        match = _PART.match(text, offset)
        if match is None:
            raise ScenarioError(
                f'key {shorten(text)}: expected quotes around whole parts, as in regions."my rock".gain'
            )
        part, dot = match[1].strip(), match[2]
        try:
            parts.append(tomllib.loads(f"part = {part}")["part"] if part[:1] in ('"', "'") else part)
        except tomllib.TOMLDecodeError as error:
            raise ScenarioError(f"key {shorten(text)}: {part} is no text of TOML: {error}") from error
        offset = match.end()
    return ".".join(parts)


def split_change(text: str) -> tuple[str, str]:
    """Split ``key=value`` into the key, without its quotes, and the text of the value; "" for a missing key."""
    match = _CHANGE.fullmatch(text)
    return (plain_key(match[1]), match[2]) if match else ("", text)
