"""Decode TOML tables into typed tables, with errors that name the key, its value and the expected one."""

from __future__ import annotations

import difflib
import functools
import re
import sys
import tomllib
import types
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec

from plant_fmu.errors import TableError

MAX_FILE = 4_000_000  # maximum number of bytes of a file; the longest in the package has a thousandth of that
MAX_DEPTH = 20  # maximum number of levels of nested tables and lists
MAX_DIGITS = 400  # maximum number of digits of a whole number, more than any float has

MAX_COMPARED = 100  # maximum number of characters of a name that are compared with known names

_MAX_LISTED = 30  # maximum number of names that a message lists

_FINITE = sys.float_info.max
Finite = Annotated[float, msgspec.Meta(ge=-_FINITE, le=_FINITE)]
NonNegative = Annotated[float, msgspec.Meta(ge=0.0, le=_FINITE)]
Positive = Annotated[float, msgspec.Meta(gt=0.0, le=_FINITE)]
Unlimited = Annotated[float, msgspec.Meta(ge=0.0)]  # 0 to infinity

_STEP = re.compile(r"\.(\w+)|\[(\d+|\.\.\.)\]")  # a part of the decoder's path, such as $[0].regions[0].shape
_TYPES = {
    "object": "a table", "array": "a list", "float": "a number", "int": "a whole number", "str": "a text",
    "bool": "true or false", "null": "nothing",
}  # fmt: skip


class Table(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Base of all tables; a ValueError of a subclass's `__post_init__` begins with the key."""


def key(meaning: str, unit: str = "", more: str = "", default: str = "", **constraints: Any) -> msgspec.Meta:
    """Describe a key in Markdown: meaning, unit, addition for the reference, and the default unless it is a value."""
    # `expected` replaces the words for a pattern in error messages.
    extra = {"unit": unit, "more": more, "default": default, "expected": constraints.pop("expected", "")}
    return msgspec.Meta(description=meaning, extra=extra, **constraints)


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


def decode(table: Any, kind: Any, where: str = "") -> Any:
    """Turn a table into a `Table`, or one of several by their tags, checking every key, type and range."""
    try:
        return msgspec.convert((table,), types.GenericAlias(tuple, (kind,)))[0]  # so that every error ends in a path
    except UnicodeEncodeError as error:  # from a command line: files are read as UTF-8
        raise TableError(f"{where or 'a text'}: {error.object!r} is no UTF-8, expected text in UTF-8") from error
    except msgspec.ValidationError as error:
        raise TableError(_describe(error, table, kind, where)) from error


def require(ok: bool, key: str, received: object, expected: str) -> None:
    """Raise a ValueError that names the key of a table, unless the condition holds."""
    if not ok:
        raise ValueError(f"{key} is {received}, expected {expected}")


def hint(received: str, known: typing.Iterable[str]) -> str:
    """Format a hint for an unknown name: the nearest known one, else a list of all."""
    known, received = sorted(known), received[:MAX_COMPARED]  # a comparison takes time with the square of the length
    matches = difflib.get_close_matches(received, known, n=1, cutoff=0.5)
    if matches:
        return f"did you mean {matches[0]!r}?"
    listed = ", ".join(known) if len(known) <= _MAX_LISTED else f"{len(known)} names, such as {', '.join(known[:3])}"
    return f"expected one of {listed or '(none)'}"


@functools.cache
def fields_of(kind: type[msgspec.Struct]) -> dict[str, Any]:
    """Return the annotation of each key of a table, with its description."""
    hints = typing.get_type_hints(kind, include_extras=True)
    return {name: hints[name] for name in kind.__struct_fields__}


def types_in(annotation: Any, metas: tuple[msgspec.Meta, ...] = ()) -> Iterator[tuple[Any, tuple[msgspec.Meta, ...]]]:
    """Yield each type that an annotation permits, with its constraints and descriptions."""
    if typing.get_origin(annotation) is Annotated:
        yield from types_in(annotation.__origin__, (*metas, *annotation.__metadata__))
    elif typing.get_origin(annotation) in (typing.Union, types.UnionType):
        for choice in typing.get_args(annotation):
            yield from types_in(choice, metas)
    else:
        yield annotation, metas


def table_in(annotation: Any) -> tuple[type[Table] | None, bool]:
    """Return the table that an annotation permits, if it is one, and whether it permits a list of them."""
    for kind, _ in types_in(annotation):
        items = typing.get_args(kind)
        listed = typing.get_origin(kind) is tuple and len(items) == 2 and items[1] is Ellipsis
        for item, _ in types_in(items[0] if listed else kind):
            if isinstance(item, type) and issubclass(item, Table):
                return item, listed
    return None, False


def _describe(error: msgspec.ValidationError, table: Any, kind: Any, where: str) -> str:
    """Format an error of the decoder, which ends in a path such as ``$[0].a.b[0]``, with the name of the item."""
    text, _, location = str(error).rpartition(" - at ")
    value, annotation, unit, item = table, kind, "", ""
    for name, index in _STEP.findall(location)[1:]:
        choices = list(types_in(annotation))
        unit = next((meta.extra["unit"] for _, metas in choices for meta in metas if meta.extra), unit)
        annotation, step = _enter(choices, value, name or index)
        value = value[step]
        where += f"[{step}]" if isinstance(step, int) else f".{step}" if where else step
        if isinstance(step, int) and isinstance(value, dict) and isinstance(value.get("name"), str):
            item = f" ({where} is {value['name']!r})"
    is_own = isinstance(error.__cause__, ValueError)
    return _sentence(text, value, list(types_in(annotation)), where, unit, is_own) + item


def _sentence(text: str, value: Any, choices: list[tuple[Any, Any]], where: str, unit: str, is_own: bool) -> str:
    """Format the text of the decoder, or of a table's own check, about a value and the types that its key permits."""
    metas = [meta for _, metas in choices for meta in metas]
    extras = [meta.extra for meta in metas if meta.extra]
    unit = next((extra["unit"] for extra in extras), unit)
    shown, dot = (f"{where}: ", f"{where}.") if where else ("", "")
    if is_own:
        return f"{dot}{text}"
    if "unknown field" in text or "missing required field" in text:
        name = text[text.index("`") + 1 : text.rindex("`")]
        if "missing" in text:
            tags = [tag for tag, field in _tags(choices) if field == name]
            return f"{dot}{name} is missing" + (f", expected one of {', '.join(tags)}" if tags else "")
        known = [name for choice, _ in choices for name in _names(choice, value)]
        return f"{dot}{name}: unknown key; {hint(name, known)}"
    literals = [x for choice, _ in choices if typing.get_origin(choice) is Literal for x in choice.__args__]
    if literals:
        tip = hint(value, filter(None, literals)) if isinstance(value, str) and isinstance(literals[0], str) else ""
        listed = f"{shown}expected one of {', '.join(map(repr, literals))} (got {value!r})"
        return f"{listed}; {tip}" if tip.startswith("did") else listed
    if text.startswith("Invalid value"):  # a tag
        return f"{where} is {value!r}, unknown; {hint(str(value), choices[0][0])}"
    phrase = next((extra["expected"] for extra in extras if extra["expected"] and isinstance(value, str)), "")
    if isinstance(value, int | float) and not isinstance(value, bool) and ("<" in text or ">" in text):
        phrase = _range(metas, unit, abs(value) <= _FINITE, any(choice is float for choice, _ in choices))
    if phrase:
        return f"{where} is {value!r}, expected {phrase}"
    return f"{shown}{_plain(text)}" + ("" if isinstance(value, dict) else f" (got {value!r})")


def _names(kind: Any, value: Any) -> tuple[str, ...]:
    """Return the keys of a table; of a tagged one if it has the tag of the value."""
    if not (isinstance(kind, type) and issubclass(kind, Table)):
        return ()
    config = kind.__struct_config__
    if not config.tag_field or not isinstance(value, dict):
        return kind.__struct_fields__
    return kind.__struct_fields__ if value.get(config.tag_field) == config.tag else ()


def _enter(choices: list[tuple[Any, Any]], value: Any, step: str) -> tuple[Any, Any]:
    """Return annotation and key of an item of a value, whose types are given; `step` is ``...`` for some key."""
    for kind, _ in choices:
        items = typing.get_args(kind)
        if isinstance(value, list | tuple) and typing.get_origin(kind) is tuple and step.isdecimal():
            return items[0 if items[-1] is Ellipsis else int(step)], int(step)
        if step in _names(kind, value):
            return fields_of(kind)[step], step
        if step == "..." and typing.get_origin(kind) is dict:
            return items[1], next(key for key, item in value.items() if not _is_valid(item, items[1]))
    return [tag for tag, _ in _tags(choices)], int(step) if step.isdecimal() else step


def _tags(choices: list[tuple[Any, Any]]) -> list[tuple[str, str]]:
    """Return the tag of each table among the types, and the key that holds it."""
    configs = [kind.__struct_config__ for kind, _ in choices if isinstance(kind, type) and issubclass(kind, Table)]
    return [(str(config.tag), str(config.tag_field)) for config in configs if config.tag_field]


def _is_valid(value: Any, kind: Any) -> bool:
    try:
        msgspec.convert(value, kind)
    except msgspec.ValidationError:
        return False
    return True


def _range(metas: list[msgspec.Meta], unit: str, is_finite: bool, is_float: bool) -> str:
    """Format the range of a number, which is finite or not, and a float or a whole number."""
    low, above = next(((m.gt, "above ") for m in metas if m.gt is not None), (None, ""))
    low = next((m.ge for m in metas if m.ge is not None), low)
    high = next((m.le for m in metas if m.le is not None), None)
    unit = f" {unit}" if unit else ""
    if low is None or low == -_FINITE:
        return "a finite number" if high in (None, _FINITE) else f"at most {high:.12g}{unit}"
    if high is not None and high < _FINITE:
        if above:
            return f"above {low:.12g}{unit}, at most {high:.12g}{unit}"
        return f"{low:.12g} to {high:.12g}{unit}" if is_float else f"{low} to {high}{unit}"
    bound = f"above {low:.12g}{unit}" if above else f"{low:.12g}{unit} or above"
    if high is None and is_float:
        return f"{bound}, or inf"
    return bound if is_finite else f"a finite number, {bound}"


def _plain(text: str) -> str:
    """Replace the decoder's names of types by words."""
    for quoted in re.findall(r"`[^`]*`", text):
        names = quoted.strip("`").removesuffix(" | null").split(" | ")
        words = [_TYPES.get(name, name) for name in names]
        text = text.replace(quoted, " or ".join(words))
    return text[:1].lower() + text[1:]
