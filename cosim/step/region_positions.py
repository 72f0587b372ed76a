"""Goal and regions at their present positions, and their evaluation at a pose."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller import VehicleState
from controller.regions.region_set import PackedRegions, clearance_of_pose, evaluate_packed

if TYPE_CHECKING:
    from cosim.step.step_model import StepData, StepModel

Array = NDArray[np.float64]


class RegionEvaluation(NamedTuple):
    """Values of goal and n regions at a pose; the goal's come first."""

    values: Array  # (n + 1,) g, above 0 where violated
    gradients: Array  # (n + 1, 3) derivative of g by position, world frame
    rotation_gradients: Array  # (n + 1, 3) derivative of g by rotation, body frame [1/rad]
    clearances: Array  # (n + 1,) distance left to each boundary: m, or rad of attitude


def evaluate(model: StepModel, data: StepData, state: VehicleState, evaluation: RegionEvaluation) -> None:
    """Evaluate goal and regions at a pose: all values for a record, otherwise clearances alone."""
    if model.for_record:
        evaluate_all(data, state, evaluation)
    else:
        write_clearances_of_pose(data.goal, state, evaluation.clearances[:1])
        write_clearances_of_pose(data.regions, state, evaluation.clearances[1:])


def evaluate_all(data: StepData, state: VehicleState, evaluation: RegionEvaluation) -> None:
    """Evaluate goal and regions at a pose, with values and gradients."""
    p, e, g, c = state.position, state.quaternion, evaluation.values, evaluation.clearances
    slopes, turns = evaluation.gradients, evaluation.rotation_gradients
    evaluate_packed(data.goal, p, e, g[:1], slopes[:1], turns[:1], c[:1])
    evaluate_packed(data.regions, p, e, g[1:], slopes[1:], turns[1:], c[1:])


def write_clearances_of_pose(regions: PackedRegions, state: VehicleState, clearances: Array) -> None:
    """Write the clearance of each region, [m] or [rad], at a pose."""
    for i in range(regions.kinds.size):
        clearances[i] = clearance_of_pose(regions, i, state.position, state.quaternion)


def move_regions(model: StepModel, data: StepData) -> None:
    """Move goal and regions to their positions at the present time."""
    move_packed(data.goal, data.goal_origin, data.now)
    move_packed(data.regions, data.region_origins, data.now)
    for i in range(model.moving_regions.size):
        region = model.moving_regions[i]
        if region > 0:
            data.shifts[i] = data.regions.shifts[region - 1]
        else:
            data.shifts[i] = (data.goal_center + data.goal.shifts[0]) - model.goal_center


def move_packed(regions: PackedRegions, origins: Array, now: float) -> None:
    """Move regions to their positions at a time [s]; origins (n, 3) [m, NED]."""
    regions.shifts[:] = regions.velocities * now + origins
