"""Decode TOML tables into frozen dataclasses, with errors that name the key, its value and the expected one."""

from __future__ import annotations

import dataclasses
import difflib
import functools
import math
import tomllib
import types
import typing
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from plant_fmu.errors import TableError

T = TypeVar("T")

MAX_FILE = 4_000_000  # maximum number of bytes of a file; the longest in the package has a thousandth of that
MAX_DEPTH = 20  # maximum number of levels of nested tables and lists
MAX_DIGITS = 400  # maximum number of digits of a whole number, more than any float has

_MAX_COMPARED = 100  # maximum number of characters of a name that are compared with known names

_MAX_LISTED = 30  # maximum number of names that a message lists


def read_toml(path: Path) -> dict[str, Any]:
    """Return the content of a TOML file."""
    try:
        if path.exists() and not path.is_file():  # to open a pipe would wait for its other end
            raise TableError("is a folder, a pipe or a device, expected a file")
        with path.open("rb") as file:
            data = file.read(MAX_FILE + 1)
        if len(data) > MAX_FILE:
            raise TableError(f"has more than {MAX_FILE} bytes, expected at most that")
        table = tomllib.loads(data.decode())
    except OSError as error:
        raise TableError(error.strerror or str(error)) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError, ValueError) as error:
        raise TableError(f"not valid TOML: {error}") from error
    require_bounded(table)
    return table


def require_bounded(table: dict[str, Any]) -> None:
    """Refuse tables and whole numbers beyond the limits, on which Python itself would fail."""
    stack: list[tuple[str, Any, int]] = [(key, value, 1) for key, value in table.items()]
    while stack:
        key, value, depth = stack.pop()
        if depth > MAX_DEPTH:
            raise TableError(f"{key[:80]}: tables are nested deeper than {MAX_DEPTH}")
        if isinstance(value, int) and abs(value) >= 10**MAX_DIGITS:
            raise TableError(f"{key[:80]}: a whole number of more than {MAX_DIGITS} digits, expected a number")
        if isinstance(value, dict):
            stack += [(f"{key}.{inner}" if depth < 5 else key, value[inner], depth + 1) for inner in value]
        elif isinstance(value, list):
            stack += [(key, item, depth + 1) for item in value if isinstance(item, dict | list | int)]


def decode(table: dict[str, Any], kind: type[T], where: str = "") -> T:
    """Turn a table into a dataclass, checking every key and type."""
    _refuse_unknown(table, kind, where)
    try:
        return msgspec.convert(table, kind)
    except UnicodeEncodeError as error:  # from a command line: files are read as UTF-8
        raise TableError(f"{where or 'a text'}: {error.object!r} is no UTF-8, expected such a text") from error
    except msgspec.ValidationError as error:
        text, _, key_path = str(error).partition(" - at ")
        raise _type_error(text, key_path, table, kind, where) from error


def hint(received: str, known: typing.Iterable[str]) -> str:
    """Format a hint for an unknown name: the nearest known one, else a list of all."""
    known, received = sorted(known), received[:_MAX_COMPARED]  # a comparison takes time with the square of the length
    matches = difflib.get_close_matches(received, known, n=1, cutoff=0.5)
    if matches:
        return f"did you mean {matches[0]!r}?"
    listed = ", ".join(known) if len(known) <= _MAX_LISTED else f"{len(known)} names, such as {', '.join(known[:3])}"
    return f"expected one of {listed or '(none)'}"


def find_dataclass(annotation: Any) -> type | None:
    """Return the dataclass within an annotation such as ``X | None`` or ``tuple[X, ...]``, if there is one."""
    if dataclasses.is_dataclass(annotation):
        return typing.cast(type, annotation)
    if typing.get_origin(annotation) in (types.UnionType, typing.Union, tuple, list):
        return next((inner for a in typing.get_args(annotation) if (inner := find_dataclass(a))), None)
    return None


@functools.cache
def _hints(kind: Any) -> dict[str, Any]:
    return typing.get_type_hints(kind)


def _refuse_unknown(table: dict[str, Any], kind: Any, where: str) -> None:
    hints: dict[str, Any] = _hints(kind)
    names = [f.name for f in dataclasses.fields(kind)]
    for key, value in table.items():
        key_path = f"{where}.{key}" if where else key
        if key not in names:
            raise TableError(f"{key_path}: unknown key; {hint(key, names)}")
        inner = find_dataclass(hints[key])
        if inner and isinstance(value, dict):
            _refuse_unknown(value, inner, key_path)
        elif inner and isinstance(value, list):
            for i, item in enumerate(value):
                if isinstance(item, dict):
                    _refuse_unknown(item, inner, f"{key_path}.{i}")


def _is_number(value: Any) -> bool:
    try:
        return not isinstance(value, bool) and math.isfinite(float(value)) and not isinstance(value, str)
    except (OverflowError, TypeError, ValueError):
        return False


def _type_error(text: str, key_path: str, table: Any, kind: Any, where: str) -> TableError:
    """Convert the decoder's error, with its path such as ``$.a.b[0]``, to one that names the key."""
    value, annotation, path = table, kind, [where] if where else []
    for step in (
        key_path.strip("`").removeprefix("$").replace("[...]", ".*").replace("[", ".").replace("]", "").split(".")
    ):
        if not step:
            continue
        if step == "*":  # some key of a mapping to numbers
            step = next((k for k, v in value.items() if not _is_number(v)), step)
            if step == "*":
                break
        if isinstance(value, list):
            value = value[int(step)]
        else:
            value = value[step]
            annotation = _hints(typing.cast(Any, annotation))[step] if dataclasses.is_dataclass(annotation) else None
            annotation = find_dataclass(annotation) or annotation
        path.append(step)

    words = {
        "Object": "table",
        "`object`": "a table",
        "`array`": "a list",
        "`float`": "a number",
        "`int`": "a whole number",
        "`float | null`": "a number",
        "`int | null`": "a whole number",
    }
    for word, replacement in words.items():
        text = text.replace(word, replacement)
    text = text[:1].lower() + text[1:].replace("`", "'")
    if typing.get_origin(annotation) is typing.Literal:
        text = f"expected one of {', '.join(map(repr, typing.get_args(annotation)))}"
    received = "" if isinstance(value, dict) else f" (got {value!r})"
    return TableError(f"{'.'.join(path) or 'file'}: {text}{received}")
