"""Re-sign a library for macOS after bytes of the library have changed."""

# Macs with ARM processors load no library without a signature. The linker's own is "ad hoc": it has no signer and holds
# a hash of each page, as in Apple's `cs_blobs.h`.

from __future__ import annotations

import hashlib
import struct

from plant_fmu.errors import BuildError

_MACH_O_64 = b"\xcf\xfa\xed\xfe"  # little-endian
_HEADER = 32  # bytes of the file's header
_CODE_SIGNATURE = 0x1D  # number of the load command that locates the signature
_DIRECTORY = 0xFADE0C02  # magic of the list of hashes; all of the signature is big-endian
_SHA256 = (32, 2)  # bytes of a hash, and its kind


def re_sign(library: bytes) -> bytes:
    """Return a library with a valid signature."""
    if not library.startswith(_MACH_O_64):
        return library
    offset = _HEADER
    for _ in range(struct.unpack_from("<I", library, 16)[0]):
        command, size = struct.unpack_from("<2I", library, offset)
        if command == _CODE_SIGNATURE:
            return _sign(library, struct.unpack_from("<I", library, offset + 8)[0])
        offset += size
    return library


def _sign(library: bytes, signature: int) -> bytes:
    directory = signature + struct.unpack_from(">I", library, signature + 16)[0]
    magic, *_, hashes, _, _, slots, limit = struct.unpack_from(">9I", library, directory)
    size, kind, _, page = struct.unpack_from(">4B", library, directory + 36)
    if magic != _DIRECTORY or (size, kind) != _SHA256 or limit != signature:
        raise BuildError("a library for macOS has a signature of an unknown kind, expected a linker's with SHA-256")
    patched = bytearray(library)
    for i in range(slots):
        content = library[i << page : min((i + 1) << page, limit)]
        offset = directory + hashes + size * i
        patched[offset : offset + size] = hashlib.sha256(content).digest()
    return bytes(patched)
