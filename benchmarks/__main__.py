"""``python -m benchmarks step``: what a step of the paper's scenario costs, part by part."""

from __future__ import annotations

import argparse
import platform
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from cosim.master import Master
from cosim.record import Recorder
from cosim.scenario import load_scenario

REPEATS = 5
STEPS = 20_000


def per_call(work: Callable[[], object], calls: int) -> tuple[float, float, float]:
    """Return the least, median and greatest microseconds a call over some repeats."""
    work()  # compile, and warm the caches
    found = []
    for _ in range(REPEATS):
        before = time.perf_counter()
        for _ in range(calls):
            work()
        found.append((time.perf_counter() - before) / calls * 1e6)
    return min(found), statistics.median(found), max(found)


def whole(engine: str, *, record: bool) -> tuple[float, float, float]:
    """Return microseconds a step of whole runs, stepped as `cosim run` does."""
    scenario = load_scenario("paper", [f"arbiter.engine={engine}", f"time.duration={STEPS / 1000}"])
    found = []
    for _ in range(REPEATS):
        with tempfile.TemporaryDirectory() as folder, Master(scenario) as master:
            observers = [Recorder(Path(folder), master.signals.columns)] if record else []
            before = time.perf_counter()
            master.run(observers)
            for recorder in observers:
                recorder.close()
            found.append((time.perf_counter() - before) / scenario.steps * 1e6)
    return min(found), statistics.median(found), max(found)


def step() -> None:
    """Print what each part of a step costs."""
    rows: list[tuple[str, tuple[float, float, float]]] = []
    rng = np.random.default_rng(0)
    with Master(load_scenario("paper", ["arbiter.engine=closed"])) as master:
        fmu = f"FMU: set {len(master.plant.inputs)}, step, get {len(master.plant.outputs)}"
        rows.append((fmu, per_call(lambda: master.plant.step(1e-3), STEPS)))
        rows.append((f"FMU: {len(master.plant.flags)} flags", per_call(master.plant.read_flags, STEPS)))
        rows.append(("regions: 4 evaluated", per_call(master._evaluate_regions, STEPS)))
        rows.append(("arbiter, closed form", per_call(master._arbitrate, STEPS)))
        rows.append(("controller, printed law", per_call(master._control, STEPS)))
        with tempfile.TemporaryDirectory() as folder:
            recorder = Recorder(Path(folder), master.signals.columns)
            rows.append(("record", per_call(lambda: recorder.observe(0, master.signals.row), STEPS)))
    with Master(load_scenario("paper", ["arbiter.engine=skfuzzy"])) as master:

        def new_inputs() -> None:
            master.arbiter(rng.random(3).tolist())

        rows.append(("arbiter, scikit-fuzzy, inputs as before", per_call(master._arbitrate, STEPS)))
        rows.append(("arbiter, scikit-fuzzy, new inputs", per_call(new_inputs, 400)))
    rows.append(("whole step, closed form, no record", whole("closed", record=False)))
    rows.append(("whole step, closed form, with record", whole("closed", record=True)))
    rows.append(("whole step, scikit-fuzzy, with record", whole("skfuzzy", record=True)))

    reference = rows[0][1][1]
    print(f"{platform.processor() or platform.machine()}, Python {platform.python_version()}, {REPEATS} repeats")
    print(f"{'microseconds a step':42} {'least':>8} {'median':>8} {'most':>8} {'x FMU':>7}")
    for name, (least, median, most) in rows:
        print(f"{name:42} {least:8.2f} {median:8.2f} {most:8.2f} {median / reference:7.2f}")


def main() -> None:
    """Run the benchmark that is named on the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks")
    parser.add_argument("name", choices=["step"], help="which benchmark")
    parser.parse_args()
    step()


if __name__ == "__main__":
    main()
