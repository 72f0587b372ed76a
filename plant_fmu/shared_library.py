"""Check a shared library's headers before the system loads it: mapping a file that is cut short kills the process."""

# ELF: System V ABI, chapters 4 and 5. PE: Microsoft's "PE Format". Mach-O: Apple's mach-o/loader.h and mach-o/fat.h.

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import IO, Any

SUFFIXES = {"linux": ".so", "windows": ".dll", "darwin": ".dylib"}  # suffix of shared libraries, by system

_FORMATS = {"linux": "ELF", "windows": "PE", "darwin": "Mach-O"}
_PROCESSORS = {  # names of FMI 3.0 by number, of each format
    "ELF": {3: "x86", 62: "x86_64", 183: "aarch64"},
    "PE": {0x14C: "x86", 0x8664: "x86_64", 0xAA64: "aarch64"},
    "Mach-O": {7: "x86", 0x01000007: "x86_64", 0x0100000C: "aarch64"},
}
_PROGRAM_HEADER = {32: ("I8xI", 4), 64: ("Q16xQ", 8)}  # ELF: offset and size of a segment, and where they stand
_MAX_PARTS = 10_000  # maximum number of load commands, or of libraries in a universal one
_SEGMENTS = {0x1: "8xII", 0x19: "16xQQ"}  # Mach-O: offset and size of a segment, by load command


class _DefectError(Exception):
    """Raised where the headers cannot be read further; the text says what the file is."""


@dataclass(frozen=True)
class _Headers:
    processor: str  # name of FMI 3.0, or the format's number
    is_library: bool  # False for a program or an object file
    end: int  # minimum number of bytes of the file


class _File:
    """A part of a file from `start`, read by formats of `struct`."""

    def __init__(self, source: IO[bytes], size: int, start: int = 0) -> None:
        self.source, self.size, self.start = source, size, start

    def read(self, offset: int, layout: str) -> tuple[Any, ...]:
        length = struct.calcsize(layout)
        if offset + length > self.size:
            raise _DefectError(_cut_short(self.size, offset + length))
        self.source.seek(self.start + offset)
        return struct.unpack(layout, self.source.read(length))


def library_defect(source: IO[bytes], size: int, platform: str, is_loaded: bool = True) -> str:
    """Describe why a shared library cannot be loaded."""
    processor, _, system = platform.partition("-")
    format_name = _FORMATS.get(system, "")
    try:
        headers = _read_headers(_File(source, size), format_name, processor)
    except _DefectError as defect:
        return str(defect)
    if headers is None:
        return f"is no {format_name} library" if is_loaded and format_name else ""
    if is_loaded and processor in _PROCESSORS[format_name].values() and headers.processor != processor:
        return f"is for processor {headers.processor}, expected {processor}"
    if is_loaded and not headers.is_library:
        return f"is no {format_name} library but another {format_name} file"
    return _cut_short(size, headers.end) if headers.end > size else ""


def _cut_short(size: int, end: int) -> str:
    return f"is cut short: {size} bytes, expected at least {end}"


def _read_headers(file: _File, format_name: str, processor: str) -> _Headers | None:
    """Read the headers of a file; of a universal one for a processor. None if it is of another format."""
    file.source.seek(0)
    magic = file.source.read(4)
    if format_name == "ELF" and magic == b"\x7fELF":
        return _elf(file)
    if format_name == "PE" and magic[:2] == b"MZ":
        return _pe(file)
    if format_name == "Mach-O" and magic in (b"\xca\xfe\xba\xbe", b"\xca\xfe\xba\xbf"):
        return _universal(file, magic[3] == 0xBF, processor)
    if format_name == "Mach-O" and magic in (b"\xcf\xfa\xed\xfe", b"\xce\xfa\xed\xfe"):
        return _mach_o(file)
    return None


def _elf(file: _File) -> _Headers:
    bits, order = file.read(4, "BB")
    if bits not in (1, 2) or order not in (1, 2):
        raise _DefectError("is no ELF library: its class or byte order is unknown")
    bits, order = 32 * bits, "<>"[order - 1]
    kind, machine = file.read(16, f"{order}HH")
    processor = _PROCESSORS["ELF"].get(machine, str(machine))
    if (bits == 32) != (processor == "x86"):
        processor += f" in {bits} bits"
    if order == ">":
        processor += ", big-endian"
    tail = 40 if bits == 32 else 52
    _, programs, sections = file.read(24, f"{order}{'III' if bits == 32 else 'QQQ'}")
    header_size, program_size, n_programs, section_size, n_sections, names = file.read(tail, f"{order}6H")
    end = max(header_size, sections + n_sections * section_size)
    if 0 < names < n_sections and file.read(sections + names * section_size + 4, f"{order}I") != (3,):
        raise _DefectError(
            "is no ELF library: its section headers are damaged"
        )  # such as zeros after a lost connection
    layout, start = _PROGRAM_HEADER[bits]
    for i in range(n_programs):
        offset, length = file.read(programs + i * program_size + start, order + layout)
        end = max(end, programs + (i + 1) * program_size, offset + length)
    return _Headers(processor, kind == 3, end)


def _pe(file: _File) -> _Headers:
    (start,) = file.read(60, "<I")
    signature, machine, n_sections = file.read(start, "<4sHH")
    if signature != b"PE\0\0":
        raise _DefectError("is no PE library: it has no PE header")
    symbols, n_symbols, optional_size, flags = file.read(start + 12, "<IIHH")
    optional = start + 24
    (magic,) = file.read(optional, "<H")
    end = optional + optional_size + 40 * n_sections
    if symbols:
        end = max(end, symbols + 18 * n_symbols)
    directories = optional + (112 if magic == 0x20B else 96)
    if optional_size >= directories + 40 - optional:
        end = max(end, sum(file.read(directories + 32, "<II")))  # certificates
    for i in range(n_sections):
        length, offset = file.read(optional + optional_size + 40 * i + 16, "<II")
        end = max(end, offset + length if length else 0)
    return _Headers(_PROCESSORS["PE"].get(machine, str(machine)), bool(flags & 0x2000), end)


def _universal(file: _File, wide: bool, expected: str) -> _Headers:
    (count,) = file.read(4, ">I")
    _require_few(count)
    layout = ">IIQQ8x" if wide else ">IIII4x"
    entry = struct.calcsize(layout)
    parts, end = [], 8 + count * entry
    for i in range(count):
        number, _, offset, size = file.read(8 + i * entry, layout)
        parts.append((_PROCESSORS["Mach-O"].get(number, str(number)), offset, size))
        end = max(end, offset + size)
    processor, offset, size = next((part for part in parts if part[0] == expected), (*parts, ("none", 0, 0))[0])
    if end > file.size or processor != expected:
        return _Headers(processor, True, end)
    inner = _mach_o(_File(file.source, size, offset))
    return _Headers(inner.processor, inner.is_library, offset + inner.end if inner.end > size else end)


def _mach_o(file: _File) -> _Headers:
    magic, machine, _, kind, count, commands_size = file.read(0, "<6I")
    _require_few(count)
    offset = 32 if magic == 0xFEEDFACF else 28
    end = offset + commands_size
    for _ in range(count):
        command, size = file.read(offset, "<II")
        if size < 8:
            raise _DefectError("is no Mach-O library: a load command has less than 8 bytes")
        if command in _SEGMENTS:
            end = max(end, sum(file.read(offset + 24, f"<{_SEGMENTS[command]}")))
        offset += size
    return _Headers(_PROCESSORS["Mach-O"].get(machine, str(machine)), kind in (6, 8), end)


def _require_few(count: int) -> None:
    if count > _MAX_PARTS:
        raise _DefectError(f"is no Mach-O library: it has {count} parts, expected at most {_MAX_PARTS}")
