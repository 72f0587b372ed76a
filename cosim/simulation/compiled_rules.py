"""Rules of an arbiter as a C function, for loops that run as C themselves."""

from __future__ import annotations

import ctypes
import dataclasses
import functools
import os
from collections.abc import Callable
from typing import Any

import numpy as np

from controller.compiling.function import INTERPRETED, BoundCall
from controller.compiling.library import library_of
from cosim.simulation.signals import Array
from fuzzy_arbiter import Arbiter, System
from fuzzy_arbiter.export import to_c

_ENTRY = """
#include <stdint.h>

/* The addresses of inputs and outputs are in words. */
void entry(const void *words)
{
    const uint64_t *address = words;
    rules_evaluate((const double *)(uintptr_t)address[0], (double *)(uintptr_t)address[1]);
}
"""


@functools.cache
def rules_text(system: System) -> str:
    """Return the C source of rules with the function ``entry``, from which their library is compiled."""
    return to_c(dataclasses.replace(system, name="rules")) + _ENTRY


class BoundRules:
    """Rules bound to their input and output arrays, which it keeps alive."""

    def __init__(self, system: System, inputs: Array, outputs: Array) -> None:
        self._kept: Any
        self.on_error: Callable[[], None] | None = None
        self.address: int
        self.words: int
        if os.environ.get(INTERPRETED):
            call = BoundCall(_Interpreted(system), (inputs, outputs))
            call.on_error = self._end
            self._kept, self.address, self.words = call, call.address, call.words
        else:
            entry = library_of(rules_text(system)).entry
            words = np.array([inputs.ctypes.data, outputs.ctypes.data], np.uint64)
            self._kept, self.words = (entry, words, inputs, outputs), words.ctypes.data
            self.address = ctypes.cast(entry, ctypes.c_void_p).value or 0

    def _end(self) -> None:
        if self.on_error is not None:
            self.on_error()

    def raise_error(self) -> None:
        """Raise the error of the last call by address, if the rules run in Python and raised one."""
        if isinstance(self._kept, BoundCall):
            self._kept.raise_error()


class _Interpreted:
    """The rules in Python."""

    def __init__(self, system: System) -> None:
        self._arbiter = Arbiter(system=system)

    def __call__(self, inputs: Array, outputs: Array) -> None:
        outputs[:] = self._arbiter(inputs.tolist())
