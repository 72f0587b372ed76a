"""Universal libraries of macOS."""

import struct
from pathlib import Path

import fmpy
import pytest

from plant_fmu.compiling.universal import universal_library
from plant_fmu.errors import BuildError
from tests.plant_fmu.libraries import parts

INTEL, ARM = 0x01000007, 0x0100000C


def library(processor, content):
    return struct.pack("<III", 0xFEEDFACF, processor, 0) + content


def test_universal_library_equals_apple_lipo_output():
    """FMPy ships libraries for both Macs, put together by others."""
    files = sorted((Path(fmpy.__file__).parent / "sundials").glob("*-darwin/*.dylib"))
    if not files:
        pytest.skip("this FMPy ships no library for Macs")
    for file in files:
        data = file.read_bytes()
        assert len(parts(data)) == 2
        assert universal_library(parts(data)) == data


def test_universal_library_is_order_independent_and_lossless():
    one, other = library(ARM, b"a" * 20_000), library(INTEL, b"x")
    whole = universal_library([one, other])
    assert whole == universal_library([other, one])
    assert parts(whole) == [other, one]


@pytest.mark.parametrize(
    ("libraries", "words"),
    [
        ([b"\x7fELF" + bytes(20)], "7f454c46"),
        ([b""], "expected 64-bit Mach-O"),
        ([library(7, b"")], "0x7, expected"),
        ([library(ARM, b"a"), library(ARM, b"b")], "two libraries"),
    ],
)
def test_incompatible_libraries_are_rejected(libraries, words):
    with pytest.raises(BuildError, match=words):
        universal_library(libraries)
