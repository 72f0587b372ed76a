"""TOML tables into frozen dataclasses, with messages that name the key, what came and what was expected."""

from __future__ import annotations

import dataclasses
import difflib
import tomllib
import types
import typing
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from plant_fmu.errors import TableError

T = TypeVar("T")


def read_toml(path: Path) -> dict[str, Any]:
    """Return the content of a TOML file.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    dict
        Its tables.

    Raises
    ------
    TableError
        If it cannot be read, or is no TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise TableError(f"{path}: {error.strerror or error}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise TableError(f"{path}: not valid TOML: {error}") from error


def decode(table: dict[str, Any], kind: type[T], where: str = "") -> T:
    """Turn a table into a dataclass, checking every key and type.

    Parameters
    ----------
    table : dict
        What a TOML file holds.
    kind : type
        A dataclass; nested dataclasses are nested tables.
    where : str
        Path of keys to this table, for messages.

    Returns
    -------
    kind
        The value.

    Raises
    ------
    TableError
        At the first key that is unknown (the nearest known one is suggested), missing, or of another type.
    """
    _refuse_unknown(table, kind, where)
    try:
        return msgspec.convert(table, kind)
    except msgspec.ValidationError as error:
        text, _, at = str(error).partition(" - at ")
        key = ".".join(part for part in (where, at.strip("`").removeprefix("$").lstrip(".")) if part)
        raise TableError(f"{key or 'file'}: {_plain(text)}{_came(table, at)}") from error


def unknown_key(key: str, known: typing.Iterable[str], where: str = "") -> TableError:
    """Return the error for a key that nothing knows, suggesting the nearest known one.

    Parameters
    ----------
    key : str
        What came.
    known : iterable of str
        What was expected.
    where : str
        Path of keys to the table.

    Returns
    -------
    TableError
        To be raised.
    """
    known = sorted(known)
    near = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
    hint = f"did you mean {near[0]!r}?" if near else f"expected one of {', '.join(known)}"
    return TableError(f"{f'{where}.' if where else ''}{key}: unknown key; {hint}")


def dataclass_of(annotation: Any) -> type | None:
    """Return the dataclass within an annotation such as ``X | None`` or ``tuple[X, ...]``, if there is one.

    Parameters
    ----------
    annotation : type
        A resolved annotation.

    Returns
    -------
    type or None
        The dataclass.
    """
    if dataclasses.is_dataclass(annotation):
        return typing.cast(type, annotation)
    if typing.get_origin(annotation) in (types.UnionType, typing.Union, tuple, list):
        return next((found for a in typing.get_args(annotation) if (found := dataclass_of(a))), None)
    return None


def _refuse_unknown(table: dict[str, Any], kind: Any, where: str) -> None:
    hints = typing.get_type_hints(kind)
    for key, value in table.items():
        if key not in hints:
            raise unknown_key(key, hints, where)
        inner = dataclass_of(hints[key])
        at = f"{where}.{key}" if where else key
        if inner and isinstance(value, dict):
            _refuse_unknown(value, inner, at)
        elif inner and isinstance(value, list):
            for i, item in enumerate(value):
                if isinstance(item, dict):
                    _refuse_unknown(item, inner, f"{at}.{i}")


def _plain(text: str) -> str:
    """Say in a file's words what the decoder says in its own."""
    words = {"Object": "table", "`object`": "a table", "`array`": "a list", "`float`": "a number", "`int`": "a whole number"}
    for word, plain in words.items():
        text = text.replace(word, plain)
    return text[:1].lower() + text[1:].replace("`", "'")


def _came(table: Any, at: str) -> str:
    """Return the value at the decoder's path, such as ``$.a.b[0]``."""
    value = table
    try:
        for key in at.strip("`").removeprefix("$").replace("[", ".").replace("]", "").split("."):
            if key:
                value = value[int(key)] if isinstance(value, list) else value[key]
    except (KeyError, IndexError, TypeError, ValueError):
        return ""
    return f" (came: {value!r})" if not isinstance(value, dict) else ""
