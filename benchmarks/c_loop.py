"""Loop of loop.c over the plant's FMU: the least time that a master can take."""

from __future__ import annotations

import contextlib
import ctypes
import shutil
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.simulation import instantiate_fmu

from plant_fmu.compiling.compiler import compile_library, find_compiler
from plant_fmu.compiling.platforms import native_platform


class _CoSimulationInstance(ctypes.Structure):
    """The structure of the same name in loop.c."""

    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("instance", "set_reals", "do_step", "get_reals", "get_flags")),
        *((f"{name}_references", ctypes.POINTER(ctypes.c_uint)) for name in ("input", "output", "flag")),
        *((f"n_{name}", ctypes.c_size_t) for name in ("inputs", "outputs", "flags")),
        *((name, ctypes.POINTER(ctypes.c_double)) for name in ("inputs", "outputs")),
        ("flags", ctypes.c_void_p),
    )


class _FmuInstance:
    """An instance of an FMU in FMPy, with the value references of its inputs, outputs and flags in `groups`."""

    def __init__(self, path: Path) -> None:
        self.folder = str(fmpy.extract(path))
        description = fmpy.read_model_description(self.folder)
        self.fmi = int(description.fmiVersion[0])
        self.fmu: Any = instantiate_fmu(self.folder, description, "CoSimulation")
        variables = description.modelVariables
        self.references = {v.name: v.valueReference for v in variables}
        references: dict[tuple[bool, str], list[int]] = {}
        for v in variables:
            references.setdefault((v.type == "Boolean", v.causality), []).append(v.valueReference)
        self.groups = [references[False, "input"], references[False, "output"], references[True, "output"]]

    def get(self, references: list[int]) -> list[float]:
        values: list[float] = (self.fmu.getReal if self.fmi == 2 else self.fmu.getFloat64)(references)
        return values

    def initialize(self, start: dict[str, float]) -> None:
        set_values = self.fmu.setReal if self.fmi == 2 else self.fmu.setFloat64
        if self.fmi == 2:
            self.fmu.setupExperiment(startTime=0.0)
        set_values([self.references[name] for name in start], list(start.values()))
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()


@contextlib.contextmanager
def _instance(path: Path) -> Iterator[_FmuInstance]:
    instance = _FmuInstance(path)
    try:
        yield instance
    finally:
        with contextlib.suppress(FMICallException):
            instance.fmu.terminate()
        instance.fmu.freeInstance()
        shutil.rmtree(instance.folder, ignore_errors=True)


def _compile(folder: Path) -> ctypes.CDLL:
    here = native_platform()
    library = folder / f"loop{here.suffix}"
    headers = [Path(fmpy.__file__).parent / "c-code"]
    compile_library(find_compiler(), here, [Path(__file__).with_name("loop.c")], headers, library)
    loop = ctypes.CDLL(str(library))
    for function in (loop.loop_fmi2, loop.loop_fmi3):
        function.restype = ctypes.c_long
        function.argtypes = [ctypes.c_void_p, ctypes.c_long, ctypes.c_long, ctypes.c_double, ctypes.c_int]
    return loop


@contextlib.contextmanager
def c_loop(
    path: Path, start: dict[str, float], step: float, *, step_only: bool = False
) -> Iterator[Callable[[int], None]]:
    """Yield a function that runs a number of steps [s] in C, with all inputs and outputs, or `step_only`."""
    with tempfile.TemporaryDirectory(prefix="benchmark-") as scratch, _instance(path) as instance:
        loop = _compile(Path(scratch))
        instance.initialize(start)
        two, groups = instance.fmi == 2, instance.groups
        functions = ("SetReal", "DoStep", "GetReal", "GetBoolean") if two else (
            "SetFloat64", "DoStep", "GetFloat64", "GetBoolean"
        )  # fmt: skip
        pointers = [ctypes.cast(instance.fmu.dll[f"fmi{instance.fmi}{name}"], ctypes.c_void_p) for name in functions]
        references = [(ctypes.c_uint * len(group))(*group) for group in groups]
        inputs = (ctypes.c_double * len(groups[0]))(*instance.get(groups[0]))
        outputs = (ctypes.c_double * len(groups[1]))()
        flags = ((ctypes.c_int if two else ctypes.c_bool) * len(groups[2]))()
        bound = _CoSimulationInstance(
            instance.fmu.component, *pointers, *references, *map(len, groups), inputs, outputs,
            ctypes.cast(flags, ctypes.c_void_p),
        )  # fmt: skip
        run = loop.loop_fmi2 if two else loop.loop_fmi3
        first = 0

        def work(count: int) -> None:
            nonlocal first
            if run(ctypes.byref(bound), first, count, step, step_only) != count:
                raise RuntimeError(f"{path}: a step failed in the loop in C")
            first += count

        yield work
