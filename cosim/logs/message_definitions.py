"""Definitions of ROS messages, checked before rosbags makes Python code of them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

from cosim.errors import ImportLogError
from cosim.logs.records import DAMAGE

_MAX_TEXT = 1 << 17  # characters of a definition with its nested types
_SIGNS = {"ros2msg": ("\n,", 5000), "ros2idl": ("=[<,", 1000)}  # signs that take long to parse, maximum number of them
_MAX_FIELDS = 1000  # fields and constants of a type with its nested types
_MAX_DEPTH = 16  # maximum depth of nested types
_MAX_LENGTH = 1 << 20  # maximum length of an array
_MAX_COPIES = 1000  # elements of all arrays of texts and nested types, for each of which rosbags writes code
_TYPE_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*)+", re.ASCII)
_FIELD_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*", re.ASCII)
_IDL_TITLE = re.compile(r"^=+\nIDL: .*\n", re.MULTILINE)  # heading of each type in a definition
_IDL_QUOTED = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\"|[^"])*"', re.DOTALL)  # comments and texts, as rosbags finds them
_IDL_ANNOTATION = re.compile(r"(@[\w:]+\s*)\(")
_IDL_ARITHMETIC = re.compile(r"<<|[*/%^~|&(]|[+-]\s*[+-]|(?<=[\w)\]}])\s+[+-]|(?<=[\w)\]}])(?<![0-9.][eE])[+-]")
_BASE, _NAMED, _ARRAY = 1, 2, 3  # kinds of fields in rosbags; 4 is a sequence

Types = Mapping[str, Any]  # constants and fields of each type, as rosbags has them


def parse_definition(text: str, name: str, language: str) -> dict[str, Any]:
    """Parse the definition of a type and its nested types; raise ImportLogError if rosbags cannot."""
    from rosbags.typesys import TypesysError, get_types_from_idl, get_types_from_msg

    slow, max_count = _SIGNS["ros2idl" if language == "ros2idl" else "ros2msg"]
    code = _plain_idl(text) if language == "ros2idl" else text
    if len(text) > _MAX_TEXT or sum(map(code.count, slow)) > max_count:
        raise ImportLogError(f"is too long, expected at most {_MAX_TEXT} characters and {max_count} of {slow!r}")
    try:
        if language != "ros2idl":
            return dict(get_types_from_msg(text, name))
        types: dict[str, Any] = {}
        for part in filter(str.strip, _IDL_TITLE.split(text)):
            types |= get_types_from_idl(part)
    except (TypesysError, *DAMAGE) as error:
        raise ImportLogError(f"cannot be parsed: {str(error) or type(error).__name__}"[:200]) from error
    return types


def _plain_idl(text: str) -> str:
    """Return IDL without comments and texts; refuse arithmetic, which rosbags would evaluate whatever its size."""
    code = _IDL_ANNOTATION.sub(r"\1", _IDL_QUOTED.sub(" ", text))
    if operator := _IDL_ARITHMETIC.search(code):
        raise ImportLogError(f"has the operator {operator[0].strip()!r}, expected constants without arithmetic")
    return code


def reachable_types(types: Types, name: str, empty_size: int) -> dict[str, Any]:
    """Return a type and all types that it nests; `empty_size` is the size of one without fields [bytes]."""
    return _Walk(types, empty_size).visit(name, ()).reachable


class _Walk:
    """A walk over a type and its nested types."""

    def __init__(self, types: Types, empty_size: int) -> None:
        self._types, self._empty_size = types, empty_size
        self._sizes: dict[str, int] = {}  # minimum size of each type [bytes]
        self._count = self._copies = 0
        self.reachable: dict[str, Any] = {}

    def visit(self, name: str, parents: tuple[str, ...]) -> _Walk:
        if name in parents or len(parents) >= _MAX_DEPTH:
            raise ImportLogError(f"nests {name!r} in itself, or deeper than {_MAX_DEPTH} types")
        if name in self.reachable:
            return self
        if not _TYPE_NAME.fullmatch(name):
            raise ImportLogError(f"names the type {name!r}, expected identifiers such as package/msg/Name")
        if name not in self._types:
            raise ImportLogError(f"has no definition of {name!r}")
        constants, fields = self._types[name]
        self._count += len(constants) + len(fields)
        if self._count > _MAX_FIELDS:
            raise ImportLogError(f"has more than {_MAX_FIELDS} fields and constants")
        for constant, _, value in constants:
            self._require_identifier(constant)
            if isinstance(value, float) and not math.isfinite(value):
                raise ImportLogError(f"has the constant {constant} = {value}, expected a finite one")
        self._sizes[name] = 0 if fields else self._empty_size
        for field, kind in fields:
            self._require_identifier(field)
            self._sizes[name] += self._size(kind, (*parents, name))
        self.reachable[name] = self._types[name]
        return self

    def _size(self, kind: Any, parents: tuple[str, ...]) -> int:
        """Return the minimum size of a field [bytes]; visit its type."""
        if kind[0] == _BASE:
            return 1
        if kind[0] == _NAMED:
            self.visit(kind[1], parents)
            return self._sizes[kind[1]]
        (element, length), is_array = kind[1], kind[0] == _ARRAY
        if is_array and not 1 <= length <= _MAX_LENGTH:
            raise ImportLogError(f"has an array of length {length}, expected 1 to {_MAX_LENGTH}")
        size = self._size(element, parents)
        if not (size or is_array):
            raise ImportLogError(f"has a sequence of {element[1]!r}, which has no fields")
        if is_array and (element[0] == _NAMED or element[1][0] == "string"):
            self._copies += length
            if self._copies > _MAX_COPIES:
                raise ImportLogError(f"has arrays of more than {_MAX_COPIES} texts and nested types")
        return size * length if is_array else 4

    @staticmethod
    def _require_identifier(name: str) -> None:
        if not _FIELD_NAME.fullmatch(name):
            raise ImportLogError(f"names {name!r}, expected an identifier")
