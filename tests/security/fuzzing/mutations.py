"""Mutations of valid files: of their bytes, and of their values."""

from __future__ import annotations

import copy
import io
import json
import math
import random
import re
import tomllib
import zipfile
from collections.abc import Callable
from datetime import date
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import tomli_w

Bytes = Callable[[bytes, random.Random], bytes]

DEEP = 5000  # brackets within each other
_DEEP_MARK, _HUGE_MARK = "@deep@", "@huge@"  # in the place of what no writer writes

VALUES: list[Any] = [
    math.nan, math.inf, -math.inf, None, True, False, 0, -1, 1, 0.5, 1e300, -1e300, 1e-300, 10**18, 2**63, 2**64,
    10**400, "", " ", "\0", "a" * 5000, "../../x", "/etc/passwd", "\x1b[31m", "\u202e", "a\nb", "nan", "1e999", "é",
    "\udc80", [], {}, [[]], [None], {"": {}}, {"a": {"b": {"c": 1}}}, [0.0] * 500, ["a"] * 500, _DEEP_MARK, _HUGE_MARK,
]  # fmt: skip
_SCALARS = next(i for i, value in enumerate(VALUES) if isinstance(value, list))
TOKENS = [
    b"", b"\0", b'"', b"'", b"[", b"]", b"{", b"}", b"(", b")", b"<", b">", b"&", b"=", b":", b",", b";", b"\\", b"\n",
    b"\r", b"#", b"//", b"(*", b"*)", b'"""', b"nan", b"inf", b"-1", b"1e999", b"-0", b"null", b"true",
    b"9" * 400, b"9" * 5000, b"0x" + b"f" * 5000, b"\xff", b"\xc3", b"\xed\xa0\x80", b"\xf4\x90\x80\x80",
    b"\xe2\x80\xa8", b"\xef\xbb\xbf", b"\x1b[31m", b"[" * DEEP, b'{"a":' * DEEP, b"(" * DEEP, b"<a>" * DEEP,
    b"not " * 500, b"a." * 3000, b"a" * 20_000,
]  # fmt: skip


# ---- of bytes ------------------------------------------------------------------------------------------------------


def _span(content: bytes, choose: random.Random) -> tuple[int, int]:
    first, longest = choose.randrange(len(content) + 1), choose.choice([40, 40, 40, max(40, len(content) // 10)])
    return first, min(len(content), first + choose.randrange(1, longest))


def _flipped(content: bytes, choose: random.Random) -> bytes:
    changed = bytearray(content)
    for _ in range(choose.choice([1, 1, 2, 4, 8])):
        if changed:
            changed[choose.randrange(len(changed))] ^= 1 << choose.randrange(8)
    return bytes(changed)


def _cut(content: bytes, choose: random.Random) -> bytes:
    return content[: choose.randrange(len(content) + 1)]


def _inserted(content: bytes, choose: random.Random) -> bytes:
    at = choose.randrange(len(content) + 1)
    return content[:at] + choose.randbytes(choose.choice([1, 2, 8, 64])) + content[at:]


def _with_token(content: bytes, choose: random.Random) -> bytes:
    first, end = _span(content, choose)
    return content[:first] + choose.choice(TOKENS) + content[choose.choice([first, end]) :]


def _without(content: bytes, choose: random.Random) -> bytes:
    first, end = _span(content, choose)
    return content[:first] + content[end:]


def _overwritten(content: bytes, choose: random.Random) -> bytes:
    """Write zeros, ones or noise over a span, as where a card loses blocks."""
    first, end = _span(content, choose)
    return (
        content[:first] + choose.choice([bytes, lambda n: b"\xff" * n, choose.randbytes])(end - first) + content[end:]
    )


def _repeated(content: bytes, choose: random.Random) -> bytes:
    first, end = _span(content, choose)
    return content[:end] + content[first:end] * choose.choice([1, 2, 50 if end - first < 100 else 3]) + content[end:]


def _moved(content: bytes, choose: random.Random) -> bytes:
    first, end = _span(content, choose)
    rest = content[:first] + content[end:]
    at = choose.randrange(len(rest) + 1)
    return rest[:at] + content[first:end] + rest[at:]


def _other_number(content: bytes, choose: random.Random) -> bytes:
    numbers = list(re.finditer(rb"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?", content))
    if not numbers:
        return _with_token(content, choose)
    found = choose.choice(numbers)
    new = choose.choice([b"nan", b"inf", b"-inf", b"1e999", b"-1", b"0", b"9" * 5000, b"1e-320", b"true", b"null", b""])
    return content[: found.start()] + new + content[found.end() :]


def _other_lines(content: bytes, choose: random.Random) -> bytes:
    lines = content.splitlines(keepends=True)
    if len(lines) < 2:
        return _with_token(content, choose)
    i, j = choose.randrange(len(lines)), choose.randrange(len(lines))
    match choose.randrange(4):
        case 0:
            del lines[i]
        case 1:
            lines.insert(j, lines[i])
        case 2:
            lines[i], lines[j] = lines[j], lines[i]
        case _:
            lines[i] = lines[i].rstrip(b"\n") + lines[j]
    return b"".join(lines)


BYTES: list[Bytes] = [_flipped, _cut, _inserted, _with_token, _without, _overwritten, _repeated, _moved]
TEXT: list[Bytes] = [*BYTES, _with_token, _other_number, _other_lines]


# ---- of tables -----------------------------------------------------------------------------------------------------


def paths_in(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the paths of all values in a table, tables and lists among them."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    inner = [inside for key, item in items for inside in paths_in(item, (*path, key))]
    return [path, *inner] if path else inner


def changed_table(table: Any, choose: random.Random, values: list[Any]) -> Any:
    """Return a table with one or two changes of a value, a key or an item."""
    table = copy.deepcopy(table)
    for _ in range(choose.choice([1, 1, 2])):
        found = paths_in(table)
        if not found:
            return copy.deepcopy(choose.choice(values))
        *path, last = choose.choice(found)
        at = table
        for key in path:
            at = at[key]
        match choose.randrange(6):
            case 0:
                del at[last]
            case 1 if isinstance(at, dict):
                at[choose.choice(["", "a", "name", "type", f"{last}s", "é\u202e", "a" * 300, "__class__"])] = at.pop(
                    last
                )
            case 1:
                at.insert(last, copy.deepcopy(at[last]))
            case 2:  # what stands elsewhere
                there = table
                for key in choose.choice(found):
                    there = there[key]
                at[last] = copy.deepcopy(there)
            case _:
                at[last] = copy.deepcopy(choose.choice(values))
    return table


def json_text(value: Any, choose: random.Random) -> bytes:
    """Return a value as JSON, with what no writer writes, and now and then a key twice."""
    text = json.dumps(value, ensure_ascii=choose.random() < 0.5)
    text = text.replace(f'"{_DEEP_MARK}"', choose.choice(["[", '{"a":']) * DEEP).replace(f'"{_HUGE_MARK}"', "9" * 5000)
    if choose.random() < 0.1 and (keys := list(re.finditer(r'"[^"]*": ', text))):
        key = choose.choice(keys)
        text = text[: key.start()] + key[0] + choose.choice(["1", "null", '"a"', "[]"]) + ", " + text[key.start() :]
    return text.encode("utf-8", "surrogatepass")


def _json(content: bytes, choose: random.Random) -> bytes:
    return json_text(changed_table(json.loads(content), choose, VALUES), choose)


def _json_lines(content: bytes, choose: random.Random) -> bytes:
    lines = content.splitlines(keepends=True)
    i = choose.randrange(len(lines))
    lines[i] = _json(lines[i], choose) + b"\n"
    return b"".join(lines)


_TOML_VALUES = [value for value in VALUES if value not in (None, [None], "\udc80")] + [date(1979, 5, 27)]


def _toml(content: bytes, choose: random.Random) -> bytes:
    text = tomli_w.dumps(changed_table(tomllib.loads(content.decode()), choose, _TOML_VALUES))
    text = text.replace(f'"{_DEEP_MARK}"', "[" * DEEP).replace(f'"{_HUGE_MARK}"', "9" * 5000)
    return text.encode("utf-8", "surrogatepass")


# ---- of XML, archives and columns ----------------------------------------------------------------------------------


def _xml(content: bytes, choose: random.Random) -> bytes:
    match choose.randrange(4):
        case 0:  # an attribute's value
            found = list(re.finditer(rb'="[^"]*"', content))
            value = str(choose.choice(VALUES[:_SCALARS])) if choose.random() < 0.9 else "9" * 5000
            new = b'="' + value.encode("utf-8", "surrogatepass") + b'"'
        case 1:  # an attribute
            found, new = list(re.finditer(rb'\s[\w:]+="[^"]*"', content)), b""
        case 2:  # an element
            found = list(re.finditer(rb"<[^<>]*/>", content))
            new = choose.choice([b"", b"<a/>", b"<!-- -->", b"text"])
        case _:  # an element twice, or one within the other
            found = list(re.finditer(rb"<[^<>/?!]*/?>", content))
            if found:
                at = choose.choice(found)
                return content[: at.end()] + at[0] * choose.choice([1, 1, 200]) + content[at.end() :]
            new = b""
    if not found:
        return _with_token(content, choose)
    at = choose.choice(found)
    return content[: at.start()] + new + content[at.end() :]


def _zip(content: bytes, choose: random.Random) -> bytes:
    """Change one member, or its entry in the archive."""
    made = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as source, zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as target:
        members = source.namelist()
        picked = choose.choice(members)
        for name in members:
            data = source.read(name)
            if name == picked:
                match choose.randrange(4):
                    case 0:
                        continue
                    case 1:
                        name = choose.choice(["../x", "/x", name.upper(), f"{name}/", "a\\b", "é" * 300, "x\x1b[31m"])
                    case _:
                        data = choose.choice(TEXT)(data[:100_000], choose)
            target.writestr(name, data)
    return made.getvalue()


def _columns(content: bytes, choose: random.Random) -> bytes:
    """Change one column: its name, type, unit, place or numbers; or the number of rows."""
    table = pq.read_table(io.BytesIO(content))
    i = choose.randrange(table.num_columns)
    name, column = table.column_names[i], table.column(i)
    match choose.randrange(9):
        case 0:
            table = table.drop_columns([name])
        case 1:
            names = [*table.column_names]
            names[i] = choose.choice(["", "a", "time", "\0", "é\u202e", "a" * 5000, "x\x1b[31m"])
            table = table.rename_columns(names)
        case 2:
            other = choose.choice([0.0, 1, True, "a", b"a", [1.0], None])
            kind = choose.choice([column.type, pa.float32(), pa.float64()]) if other is None else None
            table = table.set_column(i, name, pa.array([other] * len(table), kind))
        case 3 if pa.types.is_floating(column.type):
            numbers = column.to_pylist()
            numbers[choose.randrange(len(numbers))] = choose.choice([math.nan, math.inf, -math.inf, 1e300, -1.0, 0.0])
            table = table.set_column(i, table.schema.field(i), pa.array(numbers, column.type))
        case 4:
            table = table.slice(0, choose.choice([0, 0, 1, 2]))
        case 5:
            table = pa.concat_tables([table] * choose.choice([2, 3]))
        case 6:
            odd = choose.choice([b"\xff", b"", b"a" * 5000, b"\x1b[31m"])
            table = table.set_column(i, table.schema.field(i).with_metadata({b"unit": odd}), column)
        case 7:
            table = table.select([*range(i, table.num_columns), *range(i)])
        case _:
            table = table.append_column(choose.choice([name, "of another"]), column)
    made = io.BytesIO()
    pq.write_table(table, made, compression="none", use_dictionary=False, write_statistics=False)  # in half the time
    return made.getvalue()


_OF_CONTENT: dict[str, list[Bytes]] = {
    "json": [_json], "jsonl": [_json_lines], "toml": [_toml], "xml": [_xml], "zip": [_zip], "parquet": [_columns],
    "text": [], "bytes": [],
}  # fmt: skip


def mutated(content: bytes, kind: str, number: int) -> bytes:
    """Change a valid file of a kind in `_OF_CONTENT`: every other change is of its values, the others of its bytes."""
    choose = random.Random(number)
    changes = BYTES if kind in ("zip", "parquet", "bytes") else TEXT
    if number % 2 and _OF_CONTENT[kind]:
        changes = _OF_CONTENT[kind]
    changed = choose.choice(changes)(content, choose)
    if choose.random() < 0.15:
        changed = choose.choice(BYTES if changes is BYTES else TEXT)(changed, choose)
    return changed
