"""The functions of a step that run as C, which are compiled before there is a plant."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from controller import Law
from controller.compiling.function import load_functions
from cosim.scenario.scenario import Scenario
from cosim.simulation.bindings import is_compiled, law_arguments
from cosim.simulation.fmu_plant import FmuPlant
from cosim.simulation.make_step import exchanged_variables, make_data, make_model, step_signals
from cosim.step.one_step import advance, show_start
from cosim.step.plant_calls import PlantCalls
from plant_fmu import Plant
from plant_fmu.build import cached_fmu
from plant_fmu.running.native import Native
from plant_fmu.vehicle_component import make_vehicle_component

INTEGERS, FLAT = np.zeros(1, np.int64), np.zeros(1)


def step_functions(scenario: Scenario, law: Law) -> list[tuple[Callable[..., None], tuple[Any, ...]]]:
    """Return the functions of a run, with arguments of the types with which it calls them."""
    inputs, outputs = exchanged_variables(scenario)
    model = make_model(scenario, law, for_record=True)
    data = make_data(
        scenario, model, law, step_signals(scenario, law, inputs, outputs), inputs, outputs, np.zeros((0, 6))
    )
    references = np.zeros(1, np.uint32)
    calls = PlantCalls(*[Native(0, 0, 0, 0, references, FLAT, references, FLAT, INTEGERS, FLAT)] * 3)
    of_law = [law.step_call(*law_arguments(model, data))] if is_compiled(law) else []
    return [*of_law, (advance, (model, data, calls, INTEGERS, np.zeros((0, 0)))), (show_start, (model, data, calls))]


def load_plant(scenario: Scenario) -> Plant | FmuPlant:
    """Load the plant: an FMU of the user's, or that of the vehicle, with inputs for components if there are any."""
    if scenario.plant_fmu:
        return FmuPlant(scenario)
    if scenario.components:
        return Plant(cached_fmu(make_vehicle_component(scenario.vehicle, coupled=True), scenario.plant.fmi))
    return Plant(scenario.vehicle, scenario.plant.fmi)


def make_plant(scenario: Scenario, law: Law) -> Plant | FmuPlant:
    """Load the plant, and load the functions of a run meanwhile: the first time both are compiled."""
    with ThreadPoolExecutor(1) as pool:
        plant = pool.submit(load_plant, scenario)
        try:
            load_functions(*step_functions(scenario, law))
        except Exception:
            plant.result().close()
            raise
        except BaseException:  # Ctrl-C ends the FMU's compilers too; a signal to this process alone waits for them
            with contextlib.suppress(Exception):
                plant.result().close()
            raise
    return plant.result()
