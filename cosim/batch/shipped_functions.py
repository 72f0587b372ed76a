"""Compiles all functions that run as C ahead of time, for machines without a compiler."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from controller import LAWS
from controller.compiling.compiler import compile_file
from controller.compiling.function import c_text
from controller.compiling.library import checksum, checksum_path, library_name
from controller.laws.deployable.path_planning.planner import empty_plan, search_path
from controller.laws.deployable.path_planning.search import PathLimits
from controller.navigation.navigator import navigate
from controller.regions.rays import ray_distances
from controller.regions.region_set import evaluate_packed, write_clearances
from cosim.scenario.arbiter_rules import PAPER_RULES
from cosim.scenario.law_factory import law_of
from cosim.scenario.scenario import load_scenario
from cosim.scenario.vehicle_model import vehicle_model
from cosim.simulation.bindings import rules_text
from cosim.simulation.make_step import exchanged_variables, make_data, make_model, make_noise, step_signals
from cosim.simulation.step_functions import FLAT, INTEGERS, step_functions
from cosim.step.arbiter_inputs import compute_inputs
from cosim.step.fmu_call import ComponentCalls, FmuCalls, call_law, exchange_component, step_component
from cosim.step.one_step import locate
from cosim.step.plant_calls import Clock
from cosim.step.plant_fmu_call import VehicleMap, step_plant_fmu, write_outputs
from cosim.step.score import FlightMetrics, fly
from plant_fmu.archive import temporary_folder
from plant_fmu.compiling.compiler import cross_compiler, find_compiler
from plant_fmu.compiling.platforms import NATIVE, Platform, cross_platforms, native_platform
from plant_fmu.running.native import Native

_TABLE = np.zeros((1, 3))


def shipped_functions() -> Iterator[tuple[Callable[..., None], tuple[Any, ...]]]:
    """Yield each function with arguments of the types with which it is called."""
    scenario = load_scenario("paper")  # the functions do not depend on the scenario
    (inputs, outputs), law = exchanged_variables(scenario), law_of(scenario)
    model = make_model(scenario, law, Clock().numbers)
    signals = step_signals(scenario, law, inputs, outputs)
    data = make_data(scenario, model, law, signals, inputs, outputs, make_noise(scenario))
    state, goal, regions = data.state, data.goal, data.regions
    yield navigate, (data.measurements, model.sensors, data.navigation, state)
    for kind in LAWS.values():
        gains, level = kind.gains_type(), np.array([1.0, 0.0, 0.0, 0.0])
        made = kind.for_vehicle(vehicle_model(scenario.vehicle), gains, level, scenario.time.control, 1)
        yield kind.function, (state, goal, regions, FLAT, gains, made.memory, np.zeros(made.n_forces))
    yield evaluate_packed, (regions, state.position, state.quaternion, FLAT, _TABLE, _TABLE, FLAT)
    yield write_clearances, (regions, _TABLE, FLAT)
    yield ray_distances, (regions, state.position, _TABLE, 1.0, FLAT)
    yield search_path, (empty_plan(1, 1), state.position, goal, regions, PathLimits(1.0, 1.0, 1.0, 1.0), 1.0, INTEGERS)
    yield compute_inputs, (model.inputs, goal, regions, state, 0.0, FLAT, data.signals)
    references = np.zeros(1, np.uint32)
    native = Native(0, 0, 0, 0, references, FLAT, references, FLAT, INTEGERS, FLAT)
    fmu = FmuCalls(native, 0.01, INTEGERS, INTEGERS, FLAT)
    component = ComponentCalls(fmu, 0, INTEGERS, INTEGERS, FLAT)
    vehicle = VehicleMap(INTEGERS, INTEGERS, np.zeros((1, 2), np.int64), 0, _TABLE, FLAT, FLAT)
    yield call_law, (fmu, model, data, FLAT)
    yield step_component, (component, model, data)
    yield exchange_component, (component, model, data)
    yield step_plant_fmu, (component, vehicle, model, data)
    yield write_outputs, (vehicle, FLAT)
    *_, (function, arguments), start = step_functions(scenario, law)
    yield fly, (*arguments[:3], FlightMetrics(), FLAT, arguments[-1])
    yield function, arguments
    yield start
    yield locate, (model, data)


def shipped_texts() -> dict[str, str]:
    """Return the C source of each function, and of the paper's arbiter, by the name of its file."""
    texts = {
        f"{function.__module__.rpartition('.')[2]}_{function.__name__}": c_text(function, arguments)
        for function, arguments in shipped_functions()
    }
    return texts | {"arbiter": rules_text(PAPER_RULES.system)}


def write_libraries(platforms: str, folder: Path) -> None:
    """Compile all functions."""
    if platforms == NATIVE:
        compilers = [(native_platform(), find_compiler())]
    else:
        compilers = [(platform, cross_compiler(platform)) for platform in cross_platforms(platforms)]
    for platform, _ in compilers:
        (folder / platform.name).mkdir()
    texts = sorted(set(shipped_texts().values()))
    with temporary_folder("subreach-") as scratch, ThreadPoolExecutor(os.cpu_count()) as pool:
        sources = [scratch / f"{library_name(text)}.c" for text in texts]
        for source, text in zip(sources, texts, strict=True):
            source.write_text(text, encoding="utf-8")
        made = [pool.submit(_compile, source, folder, *compiler) for source in sources for compiler in compilers]
        for library in made:
            library.result()


def _compile(source: Path, folder: Path, platform: Platform, compiler: list[str]) -> None:
    library = folder / platform.name / f"{source.stem}{platform.suffix}"
    compile_file(source, library, compiler)
    library.with_suffix(".lib").unlink(missing_ok=True)  # import library for linking on Windows
    checksum_path(library).write_text(checksum(library.read_bytes()))


def write_sources(folder: Path) -> None:
    """Write the C source of each function into a folder, which is created if needed."""
    folder.mkdir(parents=True, exist_ok=True)
    for stem, text in shipped_texts().items():
        (folder / f"{stem}.c").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write_sources(Path(sys.argv[1]))
