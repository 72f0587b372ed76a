"""C libraries of translated functions, built and called in tests."""

import ctypes
import subprocess

import numpy as np
import pytest

from controller.translator.arguments import argument_words
from plant_fmu.compiling.compiler import find_compiler
from plant_fmu.errors import BuildError

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-shared")
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Werror")


def compiled(text, folder, *flags, compiler=None):
    """Return the library that a compiler makes of C text."""
    try:
        command = compiler or find_compiler()
    except BuildError as error:
        pytest.skip(str(error))
    source, library = folder / "translated.c", folder / "translated.so"
    source.write_text(text, encoding="utf-8")
    done = subprocess.run(
        [*command, *FLAGS, *WARNINGS, *flags, str(source), "-o", str(library), "-lm"],
        capture_output=True, text=True, timeout=900, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[:4000]
    return library


class Called:
    """A function of a library, bound to arguments."""

    def __init__(self, library, arguments):
        self._library, self._arguments = ctypes.CDLL(str(library)), arguments
        self._entry, self._words = self._library.entry, np.array(argument_words(arguments), dtype=np.uint64)
        self._entry.argtypes, self._entry.restype = [ctypes.c_void_p], None
        self._at = self._words.ctypes.data
        check = self._library.entry_check_shapes
        check.argtypes, check.restype = [ctypes.c_void_p], ctypes.c_char_p
        assert check(self._at) is None

    def __call__(self):
        """Call it: numbers in the arguments' arrays change."""
        self._entry(self._at)
