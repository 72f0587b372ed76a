"""The law and the arbiter of a run as functions that a step can call, in C or in Python."""

from __future__ import annotations

import contextlib
from typing import Any

import numpy as np

from controller import LAWS, CompiledLaw, Law
from controller.compiling.function import BoundCall
from controller.errors import CompilationError, LawError
from controller.function_law import qualified_name
from cosim.simulation.compiled_rules import BoundRules
from cosim.simulation.signals import Array
from cosim.step.step_model import ARBITER, LAW, LawOutputs, StepData, StepModel, set_call
from fuzzy_arbiter import Arbiter

_COMPILED = "closed"  # engine whose numbers C computes too, with the same bits


def is_compiled(law: Law) -> bool:
    """Return True if C can call a law's function itself, and read its outputs from its memory."""
    return type(law) in LAWS.values() and getattr(law.step, "__func__", None) is CompiledLaw.step


def outputs_of(law: Law) -> LawOutputs:
    """Return arrays of a law's outputs: its own, or those that a step in Python fills."""
    if is_compiled(law):
        assert isinstance(law, CompiledLaw)
        return LawOutputs(law.estimate, law.expected, law.report)
    return LawOutputs(np.zeros(4), np.full(6, np.nan), np.zeros(len(law.diagnostics)))


class BoundLaw:
    """Binds a law to the arrays of a step."""

    def __init__(self, law: Law, model: StepModel, data: StepData) -> None:
        self.law, self._data = law, data
        self._forces = data.command if model.law_gives_wrench else data.thrusts
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
        arguments = data.state, data.goal, data.regions, data.weights, self._forces
        if self.compiled:
            assert isinstance(self.law, CompiledLaw)
            self._call = self.law.bound(*arguments)
        else:
            self._call = BoundCall(_PythonStep(self.law, data), arguments)
        set_call(data, LAW, self._call)

    def restart(self, fresh: CompiledLaw) -> None:
        """Give the law the numbers of another law's memory."""
        for old, new in zip(_arrays(self._memory), _arrays(fresh.memory), strict=True):
            if old.flags.writeable:
                old[...] = new
        self.law.memory = self._memory  # type: ignore[attr-defined]

    def raise_error(self) -> None:
        """Raise the error of the law's last step, if it raised one."""
        self._call.raise_error()


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


def bind_arbiter(arbiter: Arbiter, data: StepData) -> BoundRules | BoundCall:
    """Bind an arbiter's rules to the arrays of a step: in C if that has the same bits, else in Python."""
    call: BoundRules | BoundCall = BoundCall(_PythonRules(arbiter), (data.signals.inputs, data.by_criterion))
    if arbiter.engine == _COMPILED:
        with contextlib.suppress(CompilationError):  # there is no compiler for rules of a user
            call = BoundRules(arbiter.system, data.signals.inputs, data.by_criterion)
    set_call(data, ARBITER, call)
    return call


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
