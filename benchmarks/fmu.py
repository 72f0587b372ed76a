"""What a step of the odin FMU costs: in a C loop, in this project's and FMPy's Python, and as a pythonfmu export."""

from __future__ import annotations

import contextlib
import ctypes
import importlib.util
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.simulation import instantiate_fmu

from benchmarks.timing import Row, Timing, time_batches, time_calls
from plant_fmu import Plant, cached_fmu, load_vehicle
from plant_fmu.compiler import compile_library, find_compiler
from plant_fmu.platforms import native_platform

STEPS = 20_000
RATIO = "x loop"  # of the median to that of the loop in C
STEP = 0.01  # s
INPUTS = {"thrust[1]": 3.0, "thrust[6]": -2.0, "wrench.Y": 1.0}  # N
_SLOWER = 50  # how many times fewer steps of what takes that much longer


def measure(steps: int, repeats: int) -> list[Row]:
    """Time the ways to step one FMU; each sets all inputs and reads all outputs, but for those that step alone.

    Parameters
    ----------
    steps, repeats : int
        Steps a repeat, and repeats.

    Returns
    -------
    list of Row
        For the table, with ratios to the loop in C over the same FMU.
    """
    rows: list[Row] = []
    with tempfile.TemporaryDirectory(prefix="benchmark-") as scratch:
        folder = Path(scratch)
        loop = _compile_loop(folder)
        for fmi in (2, 3):
            path = cached_fmu(load_vehicle("odin"), fmi)
            base = f"FMI {fmi}: loop in C"
            timings: dict[str, Timing] = {"loop in C": _in_c(loop, path, steps, repeats)}
            for substeps in (1, 2):
                name = f"doStep alone in C, {substeps} x Runge-Kutta"
                timings[name] = _in_c(loop, path, steps, repeats, STEP / substeps)
            timings["Plant.step"] = _plant(path, steps, repeats)
            timings["FMPy, calls with lists"] = _fmpy_calls(path, steps, repeats)
            timings["FMPy, simulate_fmu"] = _fmpy_simulate(path, steps, repeats)
            rows += [Row(f"FMI {fmi}: {name}", timing, base) for name, timing in timings.items()]
        rows.append(Row("FMI 2: pythonfmu, NumPy", _pythonfmu(folder, steps, repeats), "FMI 2: loop in C"))
    return rows


# ---- in C ----


class _Slave(ctypes.Structure):
    """As in loop.c."""

    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("instance", "set_reals", "do_step", "get_reals", "get_flags")),
        *((f"{name}_references", ctypes.POINTER(ctypes.c_uint)) for name in ("input", "output", "flag")),
        *((f"n_{name}", ctypes.c_size_t) for name in ("inputs", "outputs", "flags")),
        *((name, ctypes.POINTER(ctypes.c_double)) for name in ("inputs", "outputs")),
        ("flags", ctypes.c_void_p),
    )


def _compile_loop(folder: Path) -> ctypes.CDLL:
    here = native_platform()
    library = folder / f"loop{here.suffix}"
    headers = [Path(fmpy.__file__).parent / "c-code"]
    compile_library(find_compiler(), here, [Path(__file__).with_name("loop.c")], headers, library)
    loop = ctypes.CDLL(str(library))
    for function in (loop.loop_fmi2, loop.loop_fmi3):
        function.restype = ctypes.c_long
        function.argtypes = [ctypes.c_void_p, ctypes.c_long, ctypes.c_long, ctypes.c_double, ctypes.c_int]
    return loop


def _in_c(loop: ctypes.CDLL, path: Path, steps: int, repeats: int, substep: float | None = None) -> Timing:
    """Time the loop in C; with a substep [s], only its steps."""
    with _instance(path) as opened:
        opened.initialise(INPUTS if substep is None else INPUTS | {"substep": substep})
        two, groups = opened.fmi == 2, opened.groups
        functions = ("SetReal", "DoStep", "GetReal", "GetBoolean") if two else (
            "SetFloat64", "DoStep", "GetFloat64", "GetBoolean"
        )  # fmt: skip
        pointers = [ctypes.cast(opened.fmu.dll[f"fmi{opened.fmi}{name}"], ctypes.c_void_p) for name in functions]
        references = [(ctypes.c_uint * len(group))(*group) for group in groups]
        inputs = (ctypes.c_double * len(groups[0]))(*opened.get(groups[0]))
        outputs = (ctypes.c_double * len(groups[1]))()
        flags = ((ctypes.c_int if two else ctypes.c_bool) * len(groups[2]))()
        slave = _Slave(
            opened.fmu.component, *pointers, *references, *map(len, groups), inputs, outputs,
            ctypes.cast(flags, ctypes.c_void_p),
        )  # fmt: skip
        run = loop.loop_fmi2 if two else loop.loop_fmi3
        first = 0

        def batch() -> None:
            nonlocal first
            if run(ctypes.byref(slave), first, steps, STEP, substep is not None) != steps:
                raise RuntimeError(f"{path}: a step failed in the loop in C")
            first += steps

        return time_batches(batch, steps, repeats)


# ---- in Python ----


def _plant(path: Path, steps: int, repeats: int) -> Timing:
    with Plant(path) as plant:
        plant.set(INPUTS)
        plant.initialise()
        return time_calls(lambda: plant.step(STEP), steps, repeats)


def _fmpy_calls(path: Path, steps: int, repeats: int) -> Timing:
    clock = iter(range(10**9))
    with _instance(path) as opened:
        opened.initialise({name: v for name, v in INPUTS.items() if name in opened.references})
        inputs, outputs, flags = opened.groups
        values = opened.get(inputs)
        fmu, two = opened.fmu, opened.fmi == 2
        set_values, get_values = (fmu.setReal, fmu.getReal) if two else (fmu.setFloat64, fmu.getFloat64)

        def step() -> None:
            set_values(inputs, values)
            fmu.doStep(next(clock) * STEP, STEP)
            get_values(outputs)
            fmu.getBoolean(flags)

        return time_calls(step, steps, repeats)


def _fmpy_simulate(path: Path, steps: int, repeats: int) -> Timing:
    folder = str(fmpy.extract(path))
    try:
        description = fmpy.read_model_description(folder)

        def batch() -> None:
            fmpy.simulate_fmu(
                folder, model_description=description, stop_time=steps * STEP, output_interval=STEP,
                fmi_type="CoSimulation", start_values=INPUTS,
            )  # fmt: skip

        return time_batches(batch, steps, repeats)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _pythonfmu(folder: Path, steps: int, repeats: int) -> Timing | str:
    path = export_numpy_plant(folder)
    if path is None:
        return "not timed: pip install pythonfmu"
    return _fmpy_calls(path, max(1, steps // _SLOWER), repeats)


def export_numpy_plant(folder: Path) -> Path | None:
    """Export the same plant with pythonfmu.

    Parameters
    ----------
    folder : Path
        Where the FMU is written.

    Returns
    -------
    Path, optional
        The FMU, or None where pythonfmu is not installed.
    """
    if importlib.util.find_spec("pythonfmu") is None:
        return None
    from pythonfmu.builder import FmuBuilder

    FmuBuilder.build_FMU(Path(__file__).with_name("numpy_plant.py"), folder)
    return next(folder.glob("*.fmu"))


# ---- one instance in FMPy ----


class _Opened:
    """An instance of an FMU in FMPy, with the value references of its inputs, outputs and flags in `groups`."""

    def __init__(self, path: Path) -> None:
        self.folder = str(fmpy.extract(path))
        description = fmpy.read_model_description(self.folder)
        self.fmi = int(description.fmiVersion[0])
        self.fmu: Any = instantiate_fmu(self.folder, description, "CoSimulation")
        variables = description.modelVariables
        self.references = {v.name: v.valueReference for v in variables}
        found: dict[tuple[bool, str], list[int]] = {}
        for v in variables:
            found.setdefault((v.type == "Boolean", v.causality), []).append(v.valueReference)
        self.groups = [found[False, "input"], found[False, "output"], found[True, "output"]]

    def get(self, references: list[int]) -> list[float]:
        values: list[float] = (self.fmu.getReal if self.fmi == 2 else self.fmu.getFloat64)(references)
        return values

    def initialise(self, start: dict[str, float]) -> None:
        set_values = self.fmu.setReal if self.fmi == 2 else self.fmu.setFloat64
        if self.fmi == 2:
            self.fmu.setupExperiment(startTime=0.0)
        set_values([self.references[name] for name in start], list(start.values()))
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()


@contextlib.contextmanager
def _instance(path: Path) -> Iterator[_Opened]:
    opened = _Opened(path)
    try:
        yield opened
    finally:
        with contextlib.suppress(FMICallException):
            opened.fmu.terminate()
        opened.fmu.freeInstance()
        shutil.rmtree(opened.folder, ignore_errors=True)
