"""Time of a step of the odin FMU: in a C loop, in this project's and FMPy's Python, and as a pythonfmu export."""

from __future__ import annotations

import importlib.util
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.c_loop import c_loop
from benchmarks.peers import fmpy_steps
from benchmarks.table import Row, with_base
from benchmarks.timing import Timing, time_batches, time_calls
from plant_fmu import Plant, load_vehicle
from plant_fmu.build import cached_fmu

STEPS = 20_000
RATIO = "how many times as long as the loop in C"
STEP = 0.01  # s, communication step
INPUTS = {"thrust[1]": 3.0, "thrust[6]": -2.0, "wrench.Y": 1.0}  # N, inputs by name
_SLOWER = 50  # divisor of the steps of slower contestants


def measure(steps: int, repeats: int) -> list[Row]:
    """Time the ways to step one FMU; each sets all inputs and reads all outputs, unless it only steps."""
    rows: list[Row] = []
    for fmi in (3, 2):
        path, timings = cached_fmu(load_vehicle("odin"), fmi), dict[str, Timing | str]()
        timings[f"FMI {fmi}: loop in C"] = _in_c(path, steps, repeats)
        for substeps in (1, 2):
            name = f"FMI {fmi}: doStep alone in C, {substeps} x Runge-Kutta"
            timings[name] = _in_c(path, steps, repeats, STEP / substeps)
        timings[f"FMI {fmi}: Plant.step"] = _plant(path, steps, repeats)
        for name, made in (("calls with lists", fmpy_steps.loop), ("simulate_fmu", fmpy_steps.simulate)):
            with tempfile.TemporaryDirectory(prefix="benchmark-", ignore_cleanup_errors=True) as folder:
                timings[f"FMI {fmi}: FMPy, {name}"] = _fmpy(made, path, folder, steps, repeats)
        if fmi == 2:
            timings["FMI 2: pythonfmu, NumPy"] = _pythonfmu(max(1, steps // _SLOWER), repeats)
        rows += with_base(timings)
    return rows


def _in_c(path: Path, steps: int, repeats: int, substep: float | None = None) -> Timing:
    """Time the loop in C; with a substep [s], only its steps."""
    start = INPUTS if substep is None else INPUTS | {"substep": substep}
    with c_loop(path, start, STEP, step_only=substep is not None) as work:
        return time_batches(lambda: work(steps), steps, repeats)


def _plant(path: Path, steps: int, repeats: int) -> Timing:
    with Plant(path) as plant:
        plant.set(INPUTS)
        plant.initialize()
        return time_calls(lambda: plant.step(STEP), steps, repeats)


def _fmpy(
    made: Callable[[dict[str, Any]], Callable[[int], object]], path: Path, folder: str, steps: int, repeats: int
) -> Timing:
    work = made({"fmu": str(path), "folder": folder, "start": INPUTS, "step": STEP})
    return time_batches(lambda: work(steps), steps, repeats)


def _pythonfmu(steps: int, repeats: int) -> Timing | str:
    with tempfile.TemporaryDirectory(prefix="benchmark-", ignore_cleanup_errors=True) as scratch:
        path = export_numpy_plant(Path(scratch))
        if path is None:
            return "pip install pythonfmu"
        return _fmpy(fmpy_steps.loop, path, scratch, steps, repeats)


def export_numpy_plant(folder: Path) -> Path | None:
    """Export the plant in NumPy with pythonfmu; return None if that is not installed."""
    if importlib.util.find_spec("pythonfmu") is None:
        return None
    from pythonfmu.builder import FmuBuilder

    FmuBuilder.build_FMU(Path(__file__).with_name("numpy_plant.py"), folder)
    return next(folder.glob("*.fmu"))
