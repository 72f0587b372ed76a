"""Reads what shared libraries export and need, from the formats' own tables, wherever the tests run.

ELF: System V ABI, chapters 4 and 5. PE: Microsoft's "PE Format". Mach-O: Apple's mach-o/loader.h and fat.h.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field


@dataclass
class Library:
    """One library for one processor."""

    machine: str
    exports: set[str] = field(default_factory=set)
    needs: set[str] = field(default_factory=set)
    versions: set[str] = field(default_factory=set)  # of symbols, in ELF
    name: str = ""  # that it goes by
    minimum: str = ""  # system, in Mach-O


def read_libraries(data: bytes) -> list[Library]:
    """Read a library, or those in a universal one."""
    if data[:4] == b"\x7fELF":
        return [_elf(data)]
    if data[:2] == b"MZ":
        return [_pe(data)]
    if data[:4] == b"\xca\xfe\xba\xbe":
        return [_mach_o(part) for part in parts(data)]
    assert data[:4] == b"\xcf\xfa\xed\xfe", data[:4]
    return [_mach_o(data)]


def parts(data: bytes) -> list[bytes]:
    """Split a universal library."""
    magic, count = struct.unpack_from(">II", data)
    assert magic == 0xCAFEBABE
    found = []
    for i in range(count):
        processor, _, offset, size, align = struct.unpack_from(">IIIII", data, 8 + 20 * i)
        assert offset % (1 << align) == 0
        found.append(data[offset : offset + size])
        assert struct.unpack_from("<II", found[-1]) == (0xFEEDFACF, processor)
    return found


def _text(data: bytes, start: int) -> str:
    return data[start : data.index(b"\0", start)].decode()


def _elf(data: bytes) -> Library:
    assert data[4:6] == b"\x02\x01"  # 64 bits, little-endian
    library = Library({62: "x86_64", 183: "aarch64"}[struct.unpack_from("<H", data, 18)[0]])
    (offset,) = struct.unpack_from("<Q", data, 40)
    size, count = struct.unpack_from("<HH", data, 58)
    sections = [struct.unpack_from("<IIQQQQIIQQ", data, offset + i * size) for i in range(count)]
    for _, kind, _, _, start, length, link, info, _, entry in sections:
        strings = sections[link][4]
        if kind == 11:  # dynamic symbols
            for at in range(start + entry, start + length, entry):
                name, flags, _, section = struct.unpack_from("<IBBH", data, at)
                if section != 0 and flags >> 4 != 0:
                    library.exports.add(_text(data, strings + name))
        elif kind == 6:  # dynamic section
            for at in range(start, start + length, 16):
                tag, value = struct.unpack_from("<QQ", data, at)
                if tag == 1:
                    library.needs.add(_text(data, strings + value))
                elif tag == 14:
                    library.name = _text(data, strings + value)
        elif kind == 0x6FFFFFFE:  # versions needed
            at = start
            for _ in range(info):
                _, n, _, first, following = struct.unpack_from("<HHIII", data, at)
                inner = at + first
                for _ in range(n):
                    _, _, _, name, step = struct.unpack_from("<IHHII", data, inner)
                    library.versions.add(_text(data, strings + name))
                    inner += step
                at += following
    return library


def _pe(data: bytes) -> Library:
    (start,) = struct.unpack_from("<I", data, 60)
    assert data[start : start + 4] == b"PE\0\0"
    machine, count = struct.unpack_from("<HH", data, start + 4)
    (optional_size,) = struct.unpack_from("<H", data, start + 20)
    optional = start + 24
    assert struct.unpack_from("<H", data, optional)[0] == 0x20B  # 64 bits
    sections = [struct.unpack_from("<8sIIII", data, optional + optional_size + 40 * i) for i in range(count)]

    def at(address: int) -> int:
        for _, size, where, _, raw in sections:
            if where <= address < where + size:
                return address - where + raw
        raise AssertionError(f"no section holds {address:#x}")

    library = Library({0x8664: "x86_64", 0xAA64: "aarch64"}[machine])
    exports, _, imports = struct.unpack_from("<III", data, optional + 112)
    fields = struct.unpack_from("<IIHHIIIIIII", data, at(exports))
    library.name = _text(data, at(fields[4]))
    names = struct.unpack_from(f"<{fields[7]}I", data, at(fields[9]))
    library.exports = {_text(data, at(name)) for name in names}
    entry = at(imports)
    while (name := struct.unpack_from("<IIIII", data, entry)[3]) != 0:
        library.needs.add(_text(data, at(name)))
        entry += 20
    return library


def _mach_o(data: bytes) -> Library:
    magic, processor, _, kind = struct.unpack_from("<4I", data)
    assert magic == 0xFEEDFACF and kind == 6  # a dynamic library of 64 bits
    library = Library({0x01000007: "x86_64", 0x0100000C: "aarch64"}[processor])
    for command, at, _ in commands(data):
        if command in (0xC, 0xD):  # a library it loads, its own name
            name = _text(data, at + struct.unpack_from("<I", data, at + 8)[0])
            if command == 0xC:
                library.needs.add(name)
            else:
                library.name = name
        elif command == 0x32:  # version of the system
            (version,) = struct.unpack_from("<I", data, at + 12)
            library.minimum = f"{version >> 16}.{version >> 8 & 255}"
        elif command in (0x22, 0x80000022):  # information for the loader, whose last part are exports
            start, length = struct.unpack_from("<II", data, at + 40)
            library.exports |= _exports(data[start : start + length])
        elif command == 0x80000033:  # exports on their own
            start, length = struct.unpack_from("<II", data, at + 8)
            library.exports |= _exports(data[start : start + length])
    return library


def _exports(trie: bytes) -> set[str]:
    """Walk a prefix tree of symbols, and drop the underscore that C puts before each."""

    def number(at: int) -> tuple[int, int]:
        value = shift = 0
        while True:
            byte = trie[at]
            value |= (byte & 127) << shift
            shift, at = shift + 7, at + 1
            if byte < 128:
                return value, at

    found, waiting = set(), [(0, "")]
    while waiting and trie:
        at, prefix = waiting.pop()
        size, at = number(at)
        if size:
            found.add(prefix.removeprefix("_"))
        at += size
        children, at = trie[at], at + 1
        for _ in range(children):
            label = _text(trie, at)
            child, at = number(at + len(label) + 1)
            waiting.append((child, prefix + label))
    return found


def commands(library):
    """Yield number, offset and size of each load command of a Mach-O."""
    at = 32
    for _ in range(struct.unpack_from("<I", library, 16)[0]):
        command, size = struct.unpack_from("<2I", library, at)
        yield command, at, size
        at += size
