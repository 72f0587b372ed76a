"""What shared libraries export and need, read by LIEF wherever the tests run."""

from __future__ import annotations

import atexit
import functools
import io
import re
import struct
from dataclasses import dataclass

import pytest

MACHINES = {"X86_64": "x86_64", "AMD64": "x86_64", "AARCH64": "aarch64", "ARM64": "aarch64"}


@dataclass(frozen=True)
class Library:
    """One library for one processor."""

    machine: str
    exports: set[str]
    needs: set[str]
    name: str  # that it goes by
    minimum: tuple[int, ...]  # version of the C library in ELF, of the system in Mach-O


@functools.cache
def universal(data: bytes):  # kept, for the parts of a universal library die with it
    """Parse a library for Macs, or a universal one."""
    lief = pytest.importorskip("lief", reason="lief is not installed: nothing reads libraries of other systems")
    return lief.MachO.parse(io.BytesIO(data))


atexit.register(universal.cache_clear)  # else LIEF complains of leaks


def macs(data: bytes) -> list:
    """Parse a library for Macs, or those in a universal one."""
    return list(universal(data))


def parts(data: bytes) -> list[bytes]:
    """Split a universal library."""
    return [data[mac.fat_offset : mac.fat_offset + mac.original_size] for mac in macs(data)]


def read_libraries(data: bytes) -> list[Library]:
    """Read a library, or those in a universal one."""
    lief = pytest.importorskip("lief", reason="lief is not installed: nothing reads libraries of other systems")
    if data[:4] == b"\x7fELF":
        elf = lief.ELF.parse(io.BytesIO(data))
        labels = " ".join(v.name for r in elf.symbols_version_requirement for v in r.get_auxiliary_symbols())
        versions = re.findall(r"\bGLIBC_(\d[\d.]*)", labels)  # not GLIBC_PRIVATE; none with musl
        minimum = max((tuple(map(int, version.split("."))) for version in versions), default=())
        exports = {symbol.name for symbol in elf.exported_symbols}
        return [Library(MACHINES[elf.header.machine_type.name], exports, set(elf.libraries), "", minimum)]
    if data[:2] == b"MZ":
        pe = lief.PE.parse(io.BytesIO(data))
        table = pe.get_export()
        exports = {entry.name for entry in table.entries}
        return [Library(MACHINES[pe.header.machine.name], exports, set(pe.libraries), table.name, ())]
    return [
        Library(
            MACHINES[mac.header.cpu_type.name],
            {symbol.name.removeprefix("_") for symbol in mac.exported_symbols},
            {command.name for command in mac.libraries if command.command.name == "LOAD_DYLIB"},
            next(command.name for command in mac.libraries if command.command.name == "ID_DYLIB"),
            tuple((mac.build_version.minos if mac.build_version else mac.version_min.version)[:2]),
        )
        for mac in macs(data)
    ]


def signed_pages(library: bytes, mac) -> list[tuple[int, bytes]]:
    """Return the place of the hash of each page of a signed library for Macs, and the page (Apple's cs_blobs.h)."""
    if not mac.has_code_signature:
        return []
    signature = mac.code_signature.data_offset
    directory = signature + struct.unpack_from(">I", library, signature + 16)[0]
    magic, _, _, _, hashes, _, _, slots, limit = struct.unpack_from(">9I", library, directory)
    size, kind, _, page = struct.unpack_from(">4B", library, directory + 36)
    assert (magic, size, kind, limit) == (0xFADE0C02, 32, 2, signature)  # SHA-256 of all before the signature
    assert slots == -(-limit // (1 << page))
    return [(directory + hashes + 32 * i, library[i << page : min((i + 1) << page, limit)]) for i in range(slots)]
