"""Vectorized encoding of rows of numbers as Protobuf messages."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet

from cosim.simulation.signals import Array

_FIXED_64 = 1  # wire type of a double


def numbers_schema(package: str, message: str, fields: Sequence[str]) -> bytes:
    """Make the schema of a message of doubles, a serialized ``FileDescriptorSet``."""
    file = FileDescriptorProto(name=f"{package}/{message}.proto", package=package, syntax="proto3")
    described = file.message_type.add(name=message)
    for i, name in enumerate(fields):
        described.field.add(
            name=name,
            number=i + 1,
            type=FieldDescriptorProto.TYPE_DOUBLE,
            label=FieldDescriptorProto.LABEL_OPTIONAL,
        )
    return bytes(FileDescriptorSet(file=[file]).SerializeToString())


def numbers_messages(rows: Array) -> Iterator[bytes]:
    """Yield each row as a message of `numbers_schema`; rows (n, fields)."""
    # A field consists of its key and the eight bytes of its number, so all messages have one layout, a structured
    # array.
    parts: list[tuple[str, object]] = []
    keys = [_varint((i + 1) << 3 | _FIXED_64) for i in range(rows.shape[1])]
    for i, key in enumerate(keys):
        parts += [(f"key{i}", f"V{len(key)}"), (f"value{i}", "<f8")]
    table = np.empty(len(rows), dtype=parts)
    for i, key in enumerate(keys):
        table[f"key{i}"] = np.void(key)
        table[f"value{i}"] = rows[:, i]
    size, whole = table.itemsize, table.tobytes()
    for first in range(0, size * len(rows), size) if size else ():
        yield whole[first : first + size]


def _varint(number: int) -> bytes:
    out = bytearray()
    while number > 0x7F:
        out.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes([*out, number])
