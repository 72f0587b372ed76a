"""What a step of the paper's scenario costs, part by part."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.table import Row, compared
from benchmarks.timing import Timing, time_calls
from cosim.master import Master
from cosim.record import Recorder
from cosim.scenario import load_scenario

STEPS = 20_000
RATIO = "how many times as long as the plant's step"
_SLOWER = 50  # how many times fewer calls of what takes that much longer


def measure(steps: int, repeats: int) -> list[Row]:
    """Time each part of a step, and whole steps.

    Parameters
    ----------
    steps, repeats : int
        Steps a repeat, and repeats.

    Returns
    -------
    list of Row
        For the table.
    """
    timings: dict[str, Timing | str] = {}
    rng = np.random.default_rng(0)

    def add_calls(name: str, work: Callable[[], object], calls: int = steps) -> None:
        timings[name] = time_calls(work, calls, repeats)

    with Master(load_scenario("paper", ["arbiter.engine=closed"])) as master:
        fmu = f"FMU: set {len(master.plant.inputs)}, step, get {len(master.plant.outputs)}"
        add_calls(fmu, lambda: master.plant.step(1e-3))
        add_calls(f"FMU: {len(master.plant.flags)} flags", master.plant.read_flags)
        add_calls("regions: 4 evaluated", master._evaluate_regions)
        add_calls("arbiter, closed form", master._arbitrate)
        add_calls("controller, printed law", master._control)
        with tempfile.TemporaryDirectory() as folder:
            recorder = Recorder(Path(folder), master.signals.columns)
            add_calls("record", lambda: recorder.observe(0, master.signals.row))
    with Master(load_scenario("paper", ["arbiter.engine=skfuzzy"])) as master:

        def new_inputs() -> None:
            master.arbiter(rng.random(3).tolist())

        add_calls("arbiter, scikit-fuzzy, inputs as before", master._arbitrate)
        add_calls("arbiter, scikit-fuzzy, new inputs", new_inputs, max(1, steps // _SLOWER))
    timings["whole step, closed form, no record"] = _whole("closed", steps, repeats, record=False)
    timings["whole step, closed form, with record"] = _whole("closed", steps, repeats, record=True)
    timings["whole step, scikit-fuzzy, with record"] = _whole("skfuzzy", steps, repeats, record=True)
    return compared(timings)


def _whole(engine: str, steps: int, repeats: int, *, record: bool) -> Timing:
    """Time whole runs, stepped as `cosim run` does."""
    scenario = load_scenario("paper", [f"arbiter.engine={engine}", f"time.duration={steps / 1000}"])
    found = []
    for _ in range(repeats):
        with tempfile.TemporaryDirectory() as folder, Master(scenario) as master:
            observers = [Recorder(Path(folder), master.signals.columns)] if record else []
            before = time.perf_counter()
            master.run(observers)
            for recorder in observers:
                recorder.close()
            found.append((time.perf_counter() - before) / scenario.steps)
    return Timing(tuple(found))
