"""A co-simulation FMU driven through FMPy, with buffers and calls that are made once."""

from __future__ import annotations

import contextlib
import difflib
import math
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn, Self

import numpy as np
from fmpy.fmi2 import fmi2LastSuccessfulTime, fmi2Terminated
from numpy.typing import NDArray

from plant_fmu.errors import PlantError, StepError
from plant_fmu.model_variables import ModelVariable
from plant_fmu.running.channels import DOUBLES, BoundCalls
from plant_fmu.running.instance import Instance
from plant_fmu.running.messages import WARNING
from plant_fmu.running.native import Native, stops_early
from plant_fmu.running.state import Clock
from plant_fmu.running.values import Value, convert_value, convert_values, require_settable
from plant_fmu.toml_tables import MAX_COMPARED
from plant_fmu.variables.former_names import present_name

_MAX_STEP = 1e9  # s, bound of a step
_DISCARD = 2  # status of FMI 2.0 and 3.0
_STATUS = {_DISCARD: "Discard", 3: "Error", 4: "Fatal", 5: "Pending"}
_ROUNDING = 1e-6  # tolerance of a step's length, as a fraction
_PARTIAL = "made a part of the step alone"
_ENDS = "the FMU requests the end of the simulation"
_AT_ZERO = Clock(0.0, 0, math.nan)
_FORMER_NAMES = {
    "initialise": "initialize", "initialised": "initialized", "serialise": "serialize", "deserialise": "deserialize",
}  # fmt: skip


class CoSimulationInstance:
    """A co-simulation FMU, FMI 2.0 or 3.0, that is stepped from Python."""

    def __init__(self, path: Path, brief: bool = False) -> None:
        self._instance = Instance(path)
        try:
            self._bound = bound = BoundCalls(self._instance, brief)
        except BaseException:
            self._instance.close()
            raise
        self.inputs, self.outputs, self.flags = bound.inputs, bound.outputs, bound.flags
        self._input_index = {name: i for i, name in enumerate(self.inputs.names)}
        self._output_index = {name: i for i, name in enumerate(self.outputs.names)}
        self._calls = (*bound.set_inputs, *bound.do_step, *bound.get_outputs)
        self._now, self._ended, self._last = bound.now, bound.ended, bound.last
        self._terminated = self._initializing = False
        self._given: dict[str, Value] = {}  # values that are set before the initialization
        self._set_clock(_AT_ZERO, initialized=False)

    def __getattr__(self, name: str) -> Any:
        if name not in _FORMER_NAMES:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}", name=name, obj=self)
        warnings.warn(f"{name} is now {_FORMER_NAMES[name]}", DeprecationWarning, stacklevel=2)
        return getattr(self, _FORMER_NAMES[name])

    def _set_clock(self, clock: Clock, *, initialized: bool) -> None:
        """Set the clock. The next step calls `_change_step`, whatever its length, since NaN equals no number."""
        self._start, self._count, self._last_step = clock.start, clock.count, clock.step
        self._step = math.nan
        self.time, self.initialized = clock.time, initialized

    # ---- properties ----

    @property
    def name(self) -> str:
        """The name of the model."""
        return str(self._instance.name)

    @property
    def fmi(self) -> int:
        """The FMU's FMI version, 2 or 3."""
        return self._instance.fmi

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all variables: inputs, outputs, parameters and others."""
        return tuple(self._instance.variables)

    def __repr__(self) -> str:
        state = "closed" if self._instance.closed else f"t = {self.time:.6g} s"
        return f"<{type(self).__name__} {self.name}, FMI {self.fmi}.0, {state}>"

    # ---- values ----

    def set(self, values: Mapping[str, Value]) -> None:
        """Set parameters, inputs or start values by name."""
        self._require_open()
        batches: dict[str, tuple[list[ModelVariable], list[Value]]] = {}
        by_name: dict[str, Value] = {}
        for given, value in values.items():
            variable = self._variable(given)
            if variable.name in by_name:
                raise PlantError(f"{variable.name} is set twice, expected it once: by {given} too, its former name")
            by_name[variable.name] = value
            require_settable(variable, self.initialized)
            variables, numbers = batches.setdefault(variable.type, ([], []))
            variables.append(variable)
            numbers.extend(convert_values(variable, value))
        # real numbers go last, in one call, of which the FMU takes all or none
        for _, (variables, numbers) in sorted(batches.items(), key=lambda batch: batch[0] in DOUBLES):
            self._instance.set(variables, numbers)
            for variable in variables:
                if variable.name in self._input_index:
                    self.inputs.values[self._input_index[variable.name]] = convert_value(
                        variable, by_name[variable.name]
                    )
        if self.initialized:
            self._read()
        else:
            self._given |= by_name

    def __setitem__(self, name: str, value: Value) -> None:
        name = present_name(name, self._instance.variables)
        if name in self._input_index:
            self._require_open()
            self.inputs.values[self._input_index[name]] = convert_value(self._variable(name), value)
        else:
            self.set({name: value})

    def __getitem__(self, name: str) -> Any:
        self._require_open()
        name = present_name(name, self._instance.variables)
        if name in self._input_index:
            return float(self.inputs.values[self._input_index[name]])
        variable = self._variable(name)
        if not (self.initialized or self._initializing):
            raise PlantError(f"{name} has no value before initialize()")
        if name in self._output_index and self.initialized:
            return float(self.outputs.values[self._output_index[name]])
        if variable.type in ("Binary", "Clock"):
            raise PlantError(f"{name} is of type {variable.type}, expected a number, Boolean or text")
        value: Value = self._instance.get(variable)
        return value

    def _variable(self, name: str) -> ModelVariable:
        known = self._instance.variables
        name = present_name(name, known)
        if name not in known:
            matches = difflib.get_close_matches(str(name)[:MAX_COMPARED], known, n=1)
            suggestion = (
                f"did you mean {matches[0]!r}?" if matches else f"expected one of the {len(known)} in plant.names"
            )
            raise PlantError(f"FMU variable {name!r} is unknown; {suggestion}")
        return known[name]

    def _require_open(self) -> None:
        if self._instance.closed:
            raise PlantError(f"plant {self.name} is closed")
        if self._instance.life.fatal:
            raise PlantError(f"plant {self.name} has failed fatally, and can only be closed")

    def _require_initialized(self, action: str) -> None:
        self._require_open()
        if not self.initialized:
            when = "after terminate(), until reset()" if self._terminated else "before initialize()"
            raise PlantError(f"plant {self.name} {action} {when}")

    # ---- life cycle ----

    def initialize(self, time: float = 0.0, stop_time: float | None = None, tolerance: float | None = None) -> None:
        """Initialize the FMU, and read the outputs; time [s], stop_time [s], relative tolerance of its solver."""
        self.enter_initialization(time, stop_time, tolerance)
        self.exit_initialization()

    def enter_initialization(
        self, time: float = 0.0, stop_time: float | None = None, tolerance: float | None = None
    ) -> None:
        """Enter the initialization mode, in which inputs can be set and outputs read until `exit_initialization`."""
        self._require_open()
        if self.initialized or self._initializing:
            raise PlantError(f"plant {self.name} is initialized already; reset() it first")
        if self._terminated:
            raise PlantError(f"plant {self.name} is terminated; reset() it first")
        time = _number("start time", time, "seconds")
        if not math.isfinite(time):
            raise PlantError(f"start time is {time} s, expected a finite number of seconds")
        if stop_time is not None and not _number("stop time", stop_time, "seconds") >= time:
            raise PlantError(f"stop time is {stop_time} s, expected {time} s (start time) or later")
        if tolerance is not None and not _number("tolerance", tolerance, "a number") > 0.0:
            raise PlantError(f"tolerance is {tolerance}, expected a number above 0")
        experiment = {"startTime": time, "stopTime": stop_time, "tolerance": tolerance}
        fmu = self._instance.fmu
        if self.fmi == 2:
            self._do_initialize(fmu.setupExperiment, **experiment)
            self.set(self._given)  # again, since FMUs of 20-sim forget in setupExperiment what was set before
            experiment = {}
        self._send()
        self._do_initialize(fmu.enterInitializationMode, **experiment)
        self._initializing = True
        self.time = time

    def exit_initialization(self) -> None:
        """End the initialization mode, and read the outputs."""
        if not self._initializing:
            raise PlantError(f"plant {self.name} is not in initialization mode")
        self._initializing = False
        self._do_initialize(self._instance.fmu.exitInitializationMode)
        self._instance.life.running = True
        self._set_clock(Clock(self.time, 0, math.nan), initialized=True)
        self._read()

    def _do_initialize(self, call: Any, **arguments: Any) -> None:
        try:
            self._instance.do(call, **arguments)
        except PlantError as error:
            raise PlantError(f"{error}; reset(), then set valid values") from error

    def terminate(self) -> None:
        """End the simulation. Afterwards the plant can be reset or closed; `close` terminates too."""
        self._require_initialized("cannot be terminated")
        self._instance.life.running = False
        self._terminated = True
        self._set_clock(Clock(self.time, 0, math.nan), initialized=False)
        self._instance.do(self._instance.fmu.terminate)

    def reset(self) -> None:
        """Return to the state after loading: start values of the FMU, not initialized, time 0."""
        self._require_open()
        self._instance.do(self._instance.fmu.reset)
        self._instance.life.running = self._terminated = self._initializing = False
        self._given.clear()
        self._instance.messages.take_failures()  # so that a later error does not quote earlier messages
        self.inputs.values[:] = self._bound.starts
        self._set_clock(_AT_ZERO, initialized=False)

    def step(self, step: float) -> None:
        """Send the inputs, advance by `step`, and read the outputs; step [s]."""
        if step != self._step:
            self._change_step(step)
        set_inputs, input_arguments, do_step, step_arguments, get_outputs, output_arguments = self._calls
        self._now.value = self.time
        if (status := set_inputs(*input_arguments)) > WARNING:
            self._fail(status)
        self._ended.value = False  # some FMUs do not write their results
        if (status := do_step(*step_arguments)) > WARNING:
            self._fail_step(status)
        self._count = count = self._count + 1
        self.time = self._start + count * self._step
        if stops_early(self._last.value, self.time, self._step):
            self._stop_early(self._last.value, _PARTIAL)
        if (status := get_outputs(*output_arguments)) > WARNING:
            self._fail(status)
        if self._ended.value:
            raise StepError(self.time, _ENDS)

    def prepare_steps(self, step: float) -> None:
        """Prepare steps of `step` seconds by the functions of `native_channels`."""
        self._require_initialized("cannot step")
        if step != self._step:
            self._change_step(step)

    def count_steps(self, n: int) -> None:
        """Advance the clock by `n` steps, which were made by the functions of `native_channels`."""
        self._count += n
        self.time = self._start + self._count * self._step

    def raise_failure(self, native: Native) -> NoReturn:
        """Raise the error of a step by functions of `native` or `native_channels`, or that the FMU ends after it."""
        _, ended, _, status, transferred = native.results.tolist()
        self._now.value, self._ended.value, self._last.value = self.time, bool(ended), float(native.reached[0])
        if transferred > WARNING:
            self._fail(transferred)
        if status > WARNING:
            self._fail_step(status)
        if not ended:
            self._stop_early(self._last.value, _PARTIAL)
        self.count_steps(1)
        raise StepError(self.time, _ENDS)

    def _fail(self, status: int) -> NoReturn:
        """Raise the error of a call in a step; the next step checks whether there can be one."""
        self._step = math.nan
        self._instance.life.note(status)
        raise StepError(self.time, self._failure_message(status))

    def _fail_step(self, status: int) -> NoReturn:
        """Raise the error of `doStep`: an FMU that discards a step may have made a part of it, and may have ended."""
        if status != _DISCARD:
            self._fail(status)
        ended, last, fmu = self._ended.value, self._last.value, self._instance.fmu
        if self.fmi == 2:
            with contextlib.suppress(Exception):  # not all FMUs have the functions
                last = fmu.getRealStatus(fmi2LastSuccessfulTime)
            with contextlib.suppress(Exception):
                ended = fmu.getBooleanStatus(fmi2Terminated)
        self._stop_early(last, _ENDS if ended else self._instance.messages.take_failures() or "discarded the step")

    def _stop_early(self, last: float, reason: str) -> NoReturn:
        """Set the clock to the last time that the FMU reached, if it says so, and raise an error."""
        last = last if self._now.value <= last <= self._now.value + self._step else self._now.value
        self._set_clock(Clock(last, 0, self._last_step), initialized=True)
        with contextlib.suppress(PlantError):
            self._read()
        reason = reason if reason.startswith("the FMU") else f"the FMU {reason}"
        raise StepError(self.time, reason)

    def _change_step(self, step: float) -> None:
        """Prepare steps of another length than before."""
        self._require_initialized("cannot step")
        number = isinstance(step, (int, float, np.integer, np.floating)) and not isinstance(step, bool)
        if not (number and 0.0 < step < _MAX_STEP):
            raise PlantError(f"step is {step!r}, expected seconds above 0")
        self._require_allowed(float(step))
        if step != self._last_step:
            self._start, self._count = self.time, 0
        self._step = self._last_step = self._bound.length.value = float(step)

    def _require_allowed(self, step: float) -> None:
        """Raise an error for a step that the FMU declares that it cannot make."""
        fixed, last = self._instance.fixed_step, self._last_step
        if not math.isnan(fixed) and not abs(step - round(step / fixed) * fixed) <= _ROUNDING * fixed:
            raise PlantError(f"step is {step} s, expected a multiple of the FMU's fixedInternalStepSize of {fixed} s")
        if "varying step" not in self._instance.capabilities and abs(step - last) > _ROUNDING * last:
            raise PlantError(
                f"step is {step} s, expected {last} s as before: the FMU has no canHandleVariableCommunicationStepSize"
            )

    def _send(self) -> None:
        set_inputs, input_arguments = self._bound.set_inputs
        self._require_success(set_inputs(*input_arguments), "the inputs are refused")

    def _require_success(self, status: int, what: str) -> None:
        if status > WARNING:
            self._instance.life.note(status)
            raise PlantError(f"{what}: {self._failure_message(status)}")

    def _failure_message(self, status: int) -> str:
        name = _STATUS.get(status, f"unknown status {status}")
        return self._instance.messages.take_failures() or f"the FMU failed without a message: {name}"

    def _read(self) -> None:
        get_outputs, output_arguments = self._bound.get_outputs
        self._require_success(get_outputs(*output_arguments), "the outputs cannot be read")

    def read_flags(self) -> NDArray[np.bool_]:
        """Read the Boolean outputs after the last step; returns (n,)."""
        if not self.initialized:
            self._require_initialized("has no flags")
        get_flags, flag_arguments = self._bound.get_flags
        self._require_success(get_flags(*flag_arguments), "the flags cannot be read")
        return self.flags.values

    def close(self) -> None:
        """Free the instance, unload the library and remove the extracted files. May be called twice."""
        self._instance.close()
        self._set_clock(Clock(self.time, 0, math.nan), initialized=False)

    def __reduce_ex__(self, protocol: Any) -> Any:
        raise PlantError("a plant cannot be copied or pickled, expected save() and serialize() for its state")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


def _number(what: str, value: object, expected: str) -> float:
    if not isinstance(value, (int, float, np.integer, np.floating)) or isinstance(value, bool):
        raise PlantError(f"{what} is {value!r}, expected {expected}")
    return float(value)
