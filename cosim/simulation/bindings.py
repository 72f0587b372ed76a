"""The law and the arbiter of a run as functions that a step can call, in C or in Python."""

from __future__ import annotations

import contextlib
import ctypes
import dataclasses
import functools
import os
from collections.abc import Callable
from typing import Any, TypeGuard

import numpy as np

from controller import LAWS, CompiledLaw, Law
from controller.compiling.function import INTERPRETED, BoundCall
from controller.compiling.library import load_library
from controller.errors import CompilationError, LawError
from controller.function_law import qualified_name
from cosim.scenario.law_factory import law_of
from cosim.scenario.scenario import Scenario
from cosim.simulation.fmu_law import FmuLaw
from cosim.simulation.signals import Array, Signals
from cosim.step.step_model import ARBITER, LAW, LawOutputs, StepData, StepModel, set_call
from fuzzy_arbiter import Arbiter, System
from fuzzy_arbiter.export import to_c

_COMPILED = "closed"  # engine whose numbers C computes too, with the same bits
_ENTRY = """
#include <stdint.h>

/* The addresses of inputs and outputs are in words. */
void entry(const void *words)
{
    const uint64_t *address = words;
    rules_evaluate((const double *)(uintptr_t)address[0], (double *)(uintptr_t)address[1]);
}
"""


def is_compiled(law: Law) -> TypeGuard[CompiledLaw]:
    """Return True if C can call a law's function itself, and read its outputs from its memory."""
    return type(law) in LAWS.values() and getattr(law.step, "__func__", None) is CompiledLaw.step


def outputs_of(law: Law) -> LawOutputs:
    """Return arrays of a law's outputs: its own, or those that a step in Python fills."""
    if is_compiled(law):
        return LawOutputs(law.estimate, law.expected, law.report)
    if isinstance(law, FmuLaw):
        return LawOutputs(law.estimate, np.full(6, np.nan), law.report)
    return LawOutputs(np.zeros(4), np.full(6, np.nan), np.zeros(len(law.diagnostics)))


def law_arguments(model: StepModel, data: StepData) -> tuple[Any, ...]:
    """Return the arguments of a law's step in the arrays of a step."""
    forces = data.command if model.law_gives_wrench else data.thrusts
    return data.state, data.goal, data.regions, data.weights, forces


class BoundLaw:
    """Binds a law to the arrays of a step."""

    def __init__(self, law: Law, model: StepModel, data: StepData, signals: Signals) -> None:
        self.law, self._data, self._arguments = law, data, law_arguments(model, data)
        self._model, self._signals = model, signals
        self._gains: Any = self  # no gains yet
        self._memory = getattr(law, "memory", None)
        self.compiled = is_compiled(law)
        self.refresh()

    def refresh(self) -> None:
        """Bind the law anew if its gains have changed, and copy another memory into the one that C is bound to."""
        gains, data = getattr(self.law, "gains", None), self._data
        if self.compiled and self.law.memory is not self._memory:  # type: ignore[attr-defined]
            self.restart(self.law)  # type: ignore[arg-type]
        if gains is self._gains:
            return
        self._gains = gains
        if self.compiled:
            assert isinstance(self.law, CompiledLaw)
            self._call = self.law.bound(*self._arguments)
        elif isinstance(self.law, FmuLaw):
            self._call = self.law.bind(self._model, data, self._signals, self._arguments[-1])
        else:
            self._call = BoundCall(_PythonStep(self.law, data), self._arguments)
        set_call(data, LAW, self._call)

    def reset(self, scenario: Scenario) -> None:
        """Let the law begin again."""
        if isinstance(self.law, FmuLaw):
            self.law.restart(scenario)
            self._gains = self
            self.refresh()  # a new instance of the FMU has other addresses
        else:
            self.restart(law_of(scenario))

    def restart(self, fresh: CompiledLaw) -> None:
        """Give the law the numbers of another law's memory."""
        for old, new in zip(_arrays(self._memory), _arrays(fresh.memory), strict=True):
            if old.flags.writeable:
                old[...] = new
        self.law.memory = self._memory  # type: ignore[attr-defined]

    def raise_error(self) -> None:
        """Raise the error of the law's last step, if it raised one."""
        self._call.raise_error()
        if isinstance(self.law, FmuLaw):
            self.law.raise_error()


class _PythonStep:
    """A step of a law that runs in Python."""

    def __init__(self, law: Law, data: StepData) -> None:
        self._law, self._estimate, self._out = law, data.estimate, data.law

    def __call__(self, *arguments: Any) -> None:
        law, out = self._law, self._out
        self._write("estimate", self._estimate)
        law.step(*arguments)
        if law.diagnostics:
            self._write("report", out.report)
        if isinstance(law, CompiledLaw):
            out.expected[:] = law.expected

    def _write(self, name: str, out: Array) -> None:
        """Write an output of the law into an array."""
        given = getattr(self._law, name)
        if np.shape(given) != out.shape:
            raise LawError(
                f"law {qualified_name(self._law)}: shape of {name} is {np.shape(given)}, expected {out.shape}"
            )
        out[:] = given


def bind_arbiter(arbiter: Arbiter, data: StepData) -> CompiledRules | BoundCall:
    """Bind an arbiter's rules to the arrays of a step: in C if that has the same bits, else in Python."""
    if arbiter.engine == _COMPILED:
        with contextlib.suppress(CompilationError):  # there is no compiler for rules of a user
            return bind_rules(arbiter.system, data)
    call = BoundCall(_PythonRules(arbiter), (data.signals.inputs, data.by_criterion))
    set_call(data, ARBITER, call)
    return call


def bind_rules(system: System, data: StepData) -> CompiledRules | BoundCall:
    """Bind rules to the arrays of a step in C; in Python where that runs all functions."""
    if os.environ.get(INTERPRETED):
        call: CompiledRules | BoundCall = BoundCall(
            _PythonRules(Arbiter(system)), (data.signals.inputs, data.by_criterion)
        )
    else:
        call = CompiledRules(system, data.signals.inputs, data.by_criterion)
    set_call(data, ARBITER, call)
    return call


class CompiledRules:
    """Rules as a C function, with the arrays of their inputs and outputs, which it keeps alive."""

    on_error: Callable[[], None] | None = None

    def __init__(self, system: System, inputs: Array, outputs: Array) -> None:
        entry = load_library(rules_text(system)).entry
        words = np.array([inputs.ctypes.data, outputs.ctypes.data], np.uint64)
        self._kept = entry, words, inputs, outputs
        self.address: int = ctypes.cast(entry, ctypes.c_void_p).value or 0
        self.words: int = words.ctypes.data

    def raise_error(self) -> None:
        """Raise no error, as C has none."""


@functools.cache
def rules_text(system: System) -> str:
    """Return the C source of rules with the function ``entry``, from which their library is compiled."""
    return to_c(dataclasses.replace(system, name="rules")) + _ENTRY


class _PythonRules:
    """Rules that run in Python."""

    def __init__(self, arbiter: Arbiter) -> None:
        self._arbiter = arbiter
        self._last: list[float] | None = None  # inputs from which the present weights were computed

    def __call__(self, inputs: Array, outputs: Array) -> None:
        numbers: list[float] = inputs.tolist()
        if numbers != self._last:
            self._last = numbers
            outputs[:] = self._arbiter(numbers)


def _arrays(value: Any) -> list[Array]:
    """Return all arrays of a law's memory."""
    if isinstance(value, tuple):
        return [array for item in value for array in _arrays(item)]
    return [value] if isinstance(value, np.ndarray) else []
