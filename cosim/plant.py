"""The plant as an FMU, stepped through FMPy with buffers that are made once."""

from __future__ import annotations

import ctypes
import logging
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi2 import defaultCallbacks as default_callbacks
from fmpy.fmi3 import FMU3Slave
from numpy.typing import NDArray

from cosim.errors import PlantError
from cosim.signals import Column
from plant_fmu.tables import hint

log = logging.getLogger(__name__)

Array = NDArray[np.float64]

_WARNING = 1  # the highest status that is no failure, in FMI 2.0 and 3.0


class Plant:
    """A co-simulation FMU of either FMI version, with its inputs and outputs as arrays.

    Parameters
    ----------
    path : Path
        The FMU file.

    Attributes
    ----------
    inputs : tuple of Column
        Real inputs.
    outputs : tuple of Column
        Real outputs, then Boolean ones.

    Raises
    ------
    PlantError
        If it cannot be loaded.
    """

    def __init__(self, path: Path) -> None:
        self._folder = tempfile.mkdtemp(prefix="cosim-")
        self._messages: list[str] = []
        self._fmu: Any = None  # FMPy's slave, while there is one
        try:
            self._load(path)
        except BaseException:
            self.close()
            raise

    def _load(self, path: Path) -> None:
        try:
            extract(str(path), self._folder)
            description = read_model_description(self._folder)
            fmi = 2 if description.fmiVersion.startswith("2") else 3
            kind = FMU2Slave if fmi == 2 else FMU3Slave
            fmu = kind(
                guid=description.guid,
                unzipDirectory=self._folder,
                modelIdentifier=description.coSimulation.modelIdentifier,
                instanceName=description.modelName,
            )
            if fmi == 2:
                fmu.instantiate(callbacks=self._callbacks_fmi2())
            else:
                fmu.instantiate(logMessage=self._log_fmi3)
        except Exception as error:
            raise PlantError(f"{path}: {self._said() or error}") from error
        self._fmu, self._fmi = fmu, fmi

        variables = description.modelVariables
        self._references = {v.name: v.valueReference for v in variables if v.type in ("Real", "Float64")}
        reals = [v for v in variables if v.type in ("Real", "Float64")]
        inputs = [v for v in reals if v.causality == "input"]
        outputs = [v for v in reals if v.causality == "output"]
        flags = [v for v in variables if v.type == "Boolean" and v.causality == "output"]
        self.inputs = tuple(Column(v.name, v.unit or "", v.description or "") for v in inputs)
        self.outputs = tuple(Column(v.name, v.unit or "", v.description or "") for v in (*outputs, *flags))
        self._bind(inputs, outputs, flags)

    def _bind(self, inputs: list[Any], outputs: list[Any], flags: list[Any]) -> None:
        """Make the buffers and prepare the three calls of a step."""
        fmu, fmi = self._fmu, self._fmi
        self.input_values: Array = np.array([float(v.start or 0.0) for v in inputs])
        self.output_values: Array = np.zeros(len(outputs) + len(flags))
        n_reals = len(outputs)

        def references(items: list[Any]) -> Any:
            return (ctypes.c_uint * len(items))(*(v.valueReference for v in items))

        def buffer(values: Any, n: int) -> Any:
            return (ctypes.c_double * n).from_buffer(values)

        # a name looked up with [] is a function object of its own, without FMPy's conversion of each argument
        library = fmu.dll
        instance = ctypes.c_void_p(fmu.component)
        self._time, self._step = ctypes.c_double(), ctypes.c_double()
        n_in, n_out, n_flags = (ctypes.c_size_t(n) for n in (len(inputs), n_reals, len(flags)))
        flag_type = ctypes.c_int if fmi == 2 else ctypes.c_bool
        flag_values: Any = (flag_type * len(flags))()
        self._flags = np.frombuffer(flag_values, dtype=np.int32 if fmi == 2 else np.bool_)
        self._flag_outputs = self.output_values[n_reals:]

        set_values: tuple[Any, ...] = (instance, references(inputs), n_in, buffer(self.input_values, len(inputs)))
        get_values: tuple[Any, ...] = (instance, references(outputs), n_out, buffer(self.output_values, n_reals))
        get_flags: tuple[Any, ...] = (instance, references(flags), n_flags, flag_values)
        do_step: tuple[Any, ...]
        if fmi == 2:
            names = ("fmi2SetReal", "fmi2GetReal", "fmi2GetBoolean", "fmi2DoStep")
            do_step = (instance, self._time, self._step, ctypes.c_int(1))
        else:
            names = ("fmi3SetFloat64", "fmi3GetFloat64", "fmi3GetBoolean", "fmi3DoStep")
            set_values, get_values, get_flags = (*set_values, n_in), (*get_values, n_out), (*get_flags, n_flags)
            results = [ctypes.byref(ctypes.c_bool()) for _ in range(3)]
            do_step = (instance, self._time, self._step, ctypes.c_bool(True), *results, ctypes.byref(ctypes.c_double()))
        self._calls = tuple(
            zip((library[name] for name in names), (set_values, get_values, get_flags, do_step), strict=True)
        )

    # ---- before the first step ----

    def set(self, values: Mapping[str, float]) -> None:
        """Set parameters, inputs or start values by name.

        Parameters
        ----------
        values : mapping from str to float
            In the units of the model description.

        Raises
        ------
        PlantError
            If a name is unknown, or the FMU refuses a value.
        """
        for name, value in values.items():
            if name not in self._references:
                raise PlantError(f"FMU variable {name!r} is unknown; {hint(name, self._references)}")
            setter = self._fmu.setReal if self._fmi == 2 else self._fmu.setFloat64
            self._try(setter, [self._references[name]], [value])

    def initialise(self) -> None:
        """Pass through initialisation at time 0, and read the outputs.

        Raises
        ------
        PlantError
            If the FMU finds its parameters wanting.
        """
        if self._fmi == 2:
            self._try(self._fmu.setupExperiment, startTime=0.0)
        self._try(self._fmu.enterInitializationMode)
        self._try(self._fmu.exitInitializationMode)
        self._read()

    # ---- steps ----

    def step(self, time: float, step: float) -> None:
        """Set the inputs from `input_values`, advance by `step` from `time` [s], and read `output_values`.

        Parameters
        ----------
        time, step : float
            [s].

        Raises
        ------
        PlantError
            If the FMU refuses a value or the step.
        """
        (set_values, of_set), _, _, (do_step, of_step) = self._calls
        self._time.value, self._step.value = time, step
        if set_values(*of_set) > _WARNING or do_step(*of_step) > _WARNING:
            raise PlantError(f"t = {time:.6g} s: {self._said() or 'the FMU failed without a word'}")
        self._read()

    def _read(self) -> None:
        _, (get_values, of_values), (get_flags, of_flags), _ = self._calls
        if get_values(*of_values) > _WARNING or get_flags(*of_flags) > _WARNING:
            raise PlantError(self._said() or "the FMU's outputs cannot be read")
        self._flag_outputs[:] = self._flags

    def close(self) -> None:
        """Free the instance, unload the library and remove the extracted files. May be called twice."""
        if self._fmu is not None:
            self._fmu.freeInstance()
            self._fmu = None
        shutil.rmtree(self._folder, ignore_errors=True)

    def __enter__(self) -> Plant:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # ---- messages ----

    def _try(self, call: Any, *arguments: Any, **named: Any) -> None:
        try:
            call(*arguments, **named)
        except Exception as error:
            raise PlantError(self._said() or str(error)) from error

    def _said(self) -> str:
        """Return what the FMU said since it was last asked."""
        said, self._messages[:] = "; ".join(self._messages), []
        return said

    def _hear(self, status: int, message: bytes) -> None:
        text = message.decode("utf-8", "replace")
        log.debug("FMU: %s", text)
        if status > _WARNING:
            self._messages = [*self._messages[-3:], text]

    def _log_fmi3(self, environment: Any, status: int, category: bytes, message: bytes) -> None:
        self._hear(status, message)

    def _callbacks_fmi2(self) -> fmi2CallbackFunctions:
        # not through FMPy's logger proxy, which formats variadic messages but serves one instance in the whole process
        def hear(environment: Any, name: bytes, status: int, category: bytes, message: bytes) -> None:
            self._hear(status, message)

        callbacks = fmi2CallbackFunctions()
        callbacks.logger = fmi2CallbackLoggerTYPE(hear)
        callbacks.allocateMemory = default_callbacks.allocateMemory
        callbacks.freeMemory = default_callbacks.freeMemory
        return callbacks
