"""Time of a step of the paper's scenario, part by part."""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from benchmarks.table import Row, with_base
from benchmarks.timing import Timing, time_calls
from controller.compiling.function import BoundCall
from cosim.results.recorder import Recorder
from cosim.scenario.scenario import load_scenario
from cosim.simulation.master import Master
from cosim.simulation.signals import Array
from cosim.ssp import controller_component
from cosim.step.decision import arbitrate, control
from cosim.step.one_step import locate
from plant_fmu.build import cached_fmu

STEPS = 20_000
RATIO = "how many times as long as the plant's step"
_CLOSED = "arbiter.engine=closed"
_SLOWER = 50  # divisor of the calls of slower parts


def measure(steps: int, repeats: int) -> list[Row]:
    """Time each part of a step, and whole steps."""
    timings: dict[str, Timing] = {}
    rng = np.random.default_rng(0)

    def add_calls(name: str, work: Callable[[], object], calls: int = steps) -> None:
        timings[name] = time_calls(work, calls, repeats)

    with Master(load_scenario("paper", [_CLOSED])) as master:
        fmu = f"FMU: set {len(master.plant.inputs)}, step, get {len(master.plant.outputs)}"
        add_calls(fmu, lambda: master.plant.step(1e-3))
        add_calls(f"FMU: {len(master.plant.flags)} flags", master.plant.read_flags)
        stages = {stage: BoundCall(stage, (master.model, master.data)).call for stage in (locate, arbitrate, control)}
        add_calls("regions: 4 evaluated", stages[locate])
        add_calls("arbiter, closed form", stages[arbitrate])
        add_calls("law alone, ismail_dunnigan", _law_alone(master))
        add_calls("controller: law, what it reports, inputs", stages[control])
        with tempfile.TemporaryDirectory() as folder:
            recorder = Recorder(Path(folder), master.signals.columns)
            add_calls("record", lambda: recorder.observe(0, master.signals.row))
    with Master(load_scenario("paper", ["arbiter.engine=skfuzzy"])) as master:

        def new_inputs() -> None:
            master.arbiter(rng.random(3).tolist())

        again = BoundCall(arbitrate, (master.model, master.data)).call
        add_calls("arbiter, scikit-fuzzy, inputs as before", again)
        add_calls("arbiter, scikit-fuzzy, new inputs", new_inputs, max(1, steps // _SLOWER))
    for record in (False, True):
        how = "with record" if record else "no record"
        timings[f"whole step, closed form, {how}"] = _whole("closed", steps, repeats, record=record)
    with tempfile.TemporaryDirectory() as folder:
        law = shutil.copy(cached_fmu(controller_component(load_scenario("paper", [_CLOSED])), 3), f"{folder}/law.fmu")
        timings["whole step, closed form, no record, the law as an FMU"] = _whole(
            "closed", steps, repeats, record=False, changes=[f"law.file={law}"]
        )
    timings["whole step, scikit-fuzzy, with record"] = _whole("skfuzzy", steps, repeats, record=True)
    return with_base(timings)


def _law_alone(master: Master) -> Callable[[], None]:
    data, forces = master.data, master.data.command
    weights: Array = np.zeros(len(master.scenario.regions))
    return lambda: master.law.step(data.state, data.goal, data.regions, weights, forces)


def _whole(engine: str, steps: int, repeats: int, *, record: bool, changes: Sequence[str] = ()) -> Timing:
    """Time whole runs by `Master.run`, as in `cosim run`; return the time of a step."""
    scenario = load_scenario("paper", [f"arbiter.engine={engine}", f"time.duration={steps / 1000}", *changes])
    times = []
    for _ in range(repeats):
        with tempfile.TemporaryDirectory() as folder, Master(scenario) as master:
            observers = [Recorder(Path(folder), master.signals.columns)] if record else []
            before = time.perf_counter()
            master.run(observers)
            for recorder in observers:
                recorder.close()
            times.append((time.perf_counter() - before) / scenario.steps)
    return Timing(tuple(times))
