"""What a decision of the arbiter costs, beside scikit-fuzzy and other libraries on the same rules."""

from __future__ import annotations

import importlib.util
import itertools
import json
import os
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from skfuzzy import control, trimf

from benchmarks.fuzzy_libraries import LIBRARIES
from benchmarks.timing import Row, Timing, summary, time_batches, time_calls
from fuzzy_arbiter import SECTION_VI, Arbiter, Criterion

STEPS = 20_000
RATIO = "x stock"  # of the median to that of scikit-fuzzy as its examples use it
POINTS = 101
# a Python that has pyfuzzylite or simpful, if this one has not; pyfuzzylite wants a NumPy before 2
OTHER_PYTHON = "FUZZY_LIBRARIES_PYTHON"
_MODULES = {"pyfuzzylite": "fuzzylite", "simpful": "simpful"}
_ROWS = 5  # of a batch, for each step
_SLOWER = 50  # how many times fewer calls of what takes that much longer


def measure(steps: int, repeats: int) -> list[Row]:
    """Time evaluations of the paper's rules, with new inputs at each.

    Parameters
    ----------
    steps, repeats : int
        Evaluations a repeat, and repeats; a batch has five times as many rows.

    Returns
    -------
    list of Row
        For the table.
    """
    rows: list[Row] = []
    few = max(1, steps // _SLOWER)

    def add(name: str, timing: Timing | str) -> None:
        rows.append(Row(name, timing, rows[0].name if rows else name))

    add(f"scikit-fuzzy, stock, {POINTS} points", _stock(few, repeats))
    add("scikit-fuzzy, stock, arrays", _stock_arrays(max(2, few), repeats))
    for library in LIBRARIES:
        add(f"{library}, resolution 100", _other(library, few, repeats))
    for engine in ("auto", "closed", "exact", "grid", "skfuzzy"):
        arbiter = Arbiter(engine=engine)
        add(f"one call: {engine} ({arbiter.engine})", _calls(arbiter, few if engine == "skfuzzy" else steps, repeats))
    add("one call: closed, compiled", _compiled(Arbiter(engine="closed"), steps, repeats))
    for n in (3, 10, 40):
        criteria = [Criterion(f"c{i + 1}") for i in range(n)]
        add(f"one call: closed, {n} criteria", _calls(Arbiter(criteria, engine="closed"), steps, repeats))
    batch = np.random.default_rng(0).random((_ROWS * steps, len(SECTION_VI)))
    for engine in ("closed", "exact", "grid"):
        work = _batch(Arbiter(engine=engine), batch)
        add(f"batch of {len(batch)}: {engine}", time_batches(work, len(batch), repeats))
    add("building: 40 criteria", time_calls(lambda: Arbiter(criteria), max(1, few // 10), repeats))
    return rows


def interpreter(library: str) -> str | None:
    """Return a Python that has a library: this one, or the one that an environment variable names."""
    if importlib.util.find_spec(_MODULES[library]) is not None:
        return sys.executable
    other = os.environ.get(OTHER_PYTHON)
    if other is None:
        return None
    found = subprocess.run([other, "-c", f"import {_MODULES[library]}"], capture_output=True, check=False)
    return other if found.returncode == 0 else None


def ask(python: str, **request: Any) -> dict[str, Any]:
    """Return what `benchmarks.fuzzy_libraries` answers in another process."""
    script = Path(__file__).with_name("fuzzy_libraries.py")
    done = subprocess.run([python, str(script)], input=json.dumps(request), capture_output=True, text=True, check=True)
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer


def _other(library: str, evaluations: int, repeats: int) -> Timing | str:
    python = interpreter(library)
    if python is None:
        return f"not timed: {library} is not installed"
    inputs = np.random.default_rng(0).random((evaluations, len(SECTION_VI))).tolist()
    answer = ask(python, library=library, system="section_vi", resolution=100, inputs=inputs, repeats=repeats)
    return summary(answer["microseconds"])


def _calls(arbiter: Arbiter, calls: int, repeats: int) -> Timing:
    inputs = _inputs(len(arbiter.system.inputs))
    return time_calls(lambda: arbiter(next(inputs)), calls, repeats)


def _batch(arbiter: Arbiter, inputs: np.ndarray[Any, np.dtype[np.float64]]) -> Callable[[], object]:
    return lambda: arbiter.batch(inputs)


def _compiled(arbiter: Arbiter, calls: int, repeats: int) -> Timing | str:
    if not hasattr(arbiter, "compiled"):
        return "not timed: this arbiter has no compiled function"
    work = arbiter.compiled()
    inputs = itertools.cycle([np.array(row) for row in itertools.islice(_inputs(len(SECTION_VI)), 1000)])
    outputs = np.empty(len(SECTION_VI))
    return time_calls(lambda: work(next(inputs), outputs), calls, repeats)


def _inputs(n: int) -> itertools.cycle[list[float]]:
    return itertools.cycle(np.random.default_rng(0).random((10_000, n)).tolist())


def _stock(calls: int, repeats: int) -> Timing:
    simulation, names = _simulation()
    inputs = _inputs(len(names))

    def work() -> None:
        for name, x in zip(names, next(inputs), strict=True):
            simulation.input[name] = x
        simulation.compute()

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return time_calls(work, calls, repeats)


def _stock_arrays(rows: int, repeats: int) -> Timing:
    simulation, names = _simulation()
    columns = np.random.default_rng(0).random((len(names), rows))

    def work() -> None:
        for name, column in zip(names, columns, strict=True):
            simulation.input[name] = column
        simulation.compute()

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return time_batches(work, rows, repeats)


def _simulation() -> tuple[Any, tuple[str, ...]]:
    """Build the paper's rules as scikit-fuzzy's examples build theirs."""
    universe = np.linspace(0.0, 1.0, POINTS)
    names = ("obstacle", "shape", "depth")
    inputs = [control.Antecedent(universe, name) for name in names]
    outputs = [control.Consequent(universe, f"alpha_{i + 1}") for i in range(len(names))]
    for variable in (*inputs, *outputs):
        variable["low"] = trimf(universe, [0.0, 0.0, 1.0])
        variable["high"] = trimf(universe, [0.0, 1.0, 1.0])
    obstacle, shape, depth = inputs
    rules = [
        control.Rule(obstacle["high"], outputs[0]["high"]),
        control.Rule(obstacle["low"], outputs[0]["low"]),
        control.Rule(obstacle["high"], outputs[1]["low"]),
        control.Rule(shape["low"], outputs[1]["low"]),
        control.Rule(obstacle["low"] & shape["high"], outputs[1]["high"]),
        control.Rule(obstacle["high"] | shape["high"], outputs[2]["low"]),
        control.Rule(depth["low"], outputs[2]["low"]),
        control.Rule(obstacle["low"] & shape["low"] & depth["high"], outputs[2]["high"]),
    ]
    return control.ControlSystemSimulation(control.ControlSystem(rules)), names
