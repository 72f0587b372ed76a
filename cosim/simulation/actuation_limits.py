"""Limits of the actuation that change during a run."""

from __future__ import annotations

import numpy as np

from controller.allocation import Allocation
from cosim.scenario.scenario import Scenario
from cosim.scenario.vehicle_model import vehicle_model
from cosim.simulation.stepped_plant import SteppedPlant
from cosim.step.step_model import Allocator, Array, StepData, StepModel


class ActuationLimits:
    """Sets limits of the plant, and allocates within them; the law does not receive them."""

    def __init__(self, scenario: Scenario, plant: SteppedPlant, model: StepModel, data: StepData) -> None:
        self._scenario, self._plant, self._model, self._allocator = scenario, plant, model, data.allocator
        vehicle = scenario.vehicle
        self._thrust = np.array([vehicle.thrust_min, vehicle.thrust_max])  # (2, m) N

    def set(self, parameter: str, value: float) -> None:
        """Set a limit of the plant, such as ``thrust_max[1]``."""
        self._plant.set({parameter: value})
        kind, _, rest = parameter.partition("[")
        if kind in ("thrust_min", "thrust_max"):
            self._thrust[int(kind == "thrust_max"), int(rest[:-1]) - 1] = value
            stages = failure_stages(self._scenario, self._model, self._thrust)
            for field in ("inverse", "lower", "upper"):
                getattr(self._allocator, field)[...] = getattr(stages, field)


def failure_stages(scenario: Scenario, model: StepModel, limits: Array | None = None) -> Allocator:
    """Return the arguments of the allocation for each number of reported failures; limits (2, m) [N]."""
    if not model.through_thrusters:
        return Allocator(np.zeros((1, 0, 6)), np.zeros((1, 0)), np.zeros((1, 0)), False)
    vehicle, mode = scenario.vehicle, scenario.actuation.limits
    own = vehicle.thrust_min, vehicle.thrust_max
    rights = vehicle_model(vehicle).righting_moment > 0.0
    health, stages = np.ones(vehicle.n_thrusters), []
    total = model.failed[~(model.remaining > 0.0)]
    for failed in (None, *total) if model.report_failures else (None,):
        if failed is not None:
            health[failed] = 0.0
        lower, upper = (limit * health for limit in (limits if limits is not None else own))
        stages.append(Allocation(vehicle.thruster_matrix, lower, upper, mode, rights).arguments)
    inverse, lower, upper, direction = zip(*stages, strict=True)
    return Allocator(np.array(inverse), np.array(lower), np.array(upper), direction[0])
