"""Formats a scenario as the text of its file: a line for each key, with optional comments on the meaning of keys."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import tomli_w

from cosim.scenario.keys import unit_of_shape

_WIDE = 100  # maximum number of characters of a value in one line
_INLINE = ("shape", "membership")  # tables that are written in one line if they fit
_COMMENT_AT = 40  # column at which comments begin, after a shorter line


def scenario_text(table: Mapping[str, Any], key_comments: Mapping[str, str]) -> str:
    """Format the table of a scenario as TOML."""
    return "\n".join(_lines(table, key_comments)) + "\n"


def _lines(table: Mapping[str, Any], comments: Mapping[str, str], head: str = "", path: str = "") -> Iterator[str]:
    """Yield the lines of a table: its values, then the tables in it, then its lists of tables."""
    # In the paths of comments, a list of tables has one entry for all of its items.
    values, tables, lists = [], [], []
    for key, value in table.items():
        if value and isinstance(value, list | tuple) and all(isinstance(item, Mapping) for item in value):
            lists.append((key, value))
        elif value and isinstance(value, Mapping) and (key not in _INLINE or len(_value(value)) > _WIDE):
            tables.append((key, value))
        else:
            values.append((key, value))
    for key, value in values:
        comment = comments.get(f"{path}{key}", "")
        if comments and (units := _units(table, key, value)):
            comment = ", ".join(filter(None, (units, comment)))
        yield _with(f"{_key(key)} = {_value(value)}", comment)
    for key, inner in tables:
        yield ""
        yield _with(f"[{head}{_key(key)}]", comments.get(f"{path}{key}", ""))
        yield from _lines(inner, comments, f"{head}{_key(key)}.", f"{path}{key}.")
    for key, several in lists:
        for i, one in enumerate(several):
            known = {} if i else comments  # only the first item gets comments
            yield ""
            yield _with(f"[[{head}{_key(key)}]]", known.get(f"{path}{key}", ""))
            yield from _lines(one, known, f"{head}{_key(key)}.", f"{path}{key}[].")


def _units(table: Mapping[str, Any], key: str, value: Any) -> str:
    """Return the units of a key of a shape, or of all keys of a shape in one line."""
    if isinstance(value, Mapping) and "type" in value:
        return ", ".join(sorted({unit_of_shape(value["type"], inner) for inner in value} - {""}))
    return unit_of_shape(table["type"], key) if "type" in table else ""


def _with(line: str, comment: str) -> str:
    if not comment:
        return line
    return f"# {comment}\n{line}" if "\n" in line else f"{line:{_COMMENT_AT}}  # {comment}"


def _key(key: str) -> str:
    return tomli_w.dumps({key: 0}).removesuffix(" = 0\n")


def _value(value: Any) -> str:
    """Format a value as TOML: in one line, or a long list with a line for each item; numbers in one line."""
    if isinstance(value, Mapping):
        inner = ", ".join(f"{_key(key)} = {_value(item)}" for key, item in value.items())
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(value, list | tuple):
        items = [_value(item) for item in value]
        line = f"[{', '.join(items)}]"
        is_row = all(isinstance(item, int | float) for item in value)  # as of a matrix
        return line if is_row or len(line) <= _WIDE else "[\n" + "".join(f"    {item},\n" for item in items) + "]"
    return tomli_w.dumps({"v": value}).removeprefix("v = ").removesuffix("\n")
