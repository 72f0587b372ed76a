"""Universal libraries of macOS: one file with a library for each processor, side by side."""

# The format is that of Apple's `mach-o/fat.h`: a header, big-endian whatever the processors are, names the processor,
# place and size of each library; the libraries follow, each at the start of a page, untouched.

from __future__ import annotations

import struct
from collections.abc import Sequence

from plant_fmu.errors import BuildError

FAT_MAGIC = 0xCAFEBABE
_MACH_O_64 = b"\xcf\xfa\xed\xfe"  # little-endian
_PAGE = {0x01000007: 12, 0x0100000C: 14}  # page size of x86-64 and 64-bit ARM, in bytes as a power of two
_HEADER = struct.Struct(">II")  # magic, number of libraries
_ENTRY = struct.Struct(">IIIII")  # processor, its variant, offset, size, alignment as a power of two
_PROCESSOR = struct.Struct("<II")  # after the magic of a library


def universal_library(libraries: Sequence[bytes]) -> bytes:
    """Return one library for several processors."""
    by_processor: dict[tuple[int, int], bytes] = {}
    for library in libraries:
        if len(library) < 12 or not library.startswith(_MACH_O_64):
            raise BuildError(f"library begins with {library[:4].hex()!r}, expected 64-bit Mach-O, {_MACH_O_64.hex()!r}")
        processor, variant = _PROCESSOR.unpack_from(library, 4)
        if processor not in _PAGE:
            raise BuildError(f"library is for the processor {processor:#x}, expected x86-64 or 64-bit ARM")
        if (processor, variant) in by_processor:
            raise BuildError(f"two libraries are for the processor {processor:#x}, expected one for each")
        by_processor[processor, variant] = library

    entries, body = [], b""
    start = _HEADER.size + len(by_processor) * _ENTRY.size
    for (processor, variant), library in sorted(by_processor.items()):
        page = _PAGE[processor]
        body += bytes(-(start + len(body)) % (1 << page))
        entries.append(_ENTRY.pack(processor, variant, start + len(body), len(library), page))
        body += library
    return _HEADER.pack(FAT_MAGIC, len(entries)) + b"".join(entries) + body
