"""The paper's law (25)-(29) as a law among others, see `controller.paper_law`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from controller import paper_law
from controller.law import Array, VehicleState, WrenchLaw
from controller.paper_law import Gains
from controller.potential_field import Field, empty_field, evaluate_regions
from controller.regions.region_set import PackedRegions
from controller.stack_array import Number, Vector4


class IsmailDunniganMemory(NamedTuple):
    """State between steps, and work arrays for the regions."""

    desired_quaternion: Vector4
    period: Number  # s
    estimate: Vector4  # phi-hat [N, N m]
    report: Array  # (0,)
    field: Field  # regions; its error and push are not used
    alphas: Array  # (n,) gains of the regions times their weights


def step(
    state: VehicleState,
    goal: PackedRegions,
    regions: PackedRegions,
    weights: Array,
    gains: Gains,
    memory: IsmailDunniganMemory,
    forces: Array,
) -> None:
    """Write the forces as `CompiledLaw.step`, by the paper's law."""
    field = memory.field
    # regions push by force alone (22): their derivatives by attitude are not used
    evaluate_regions(state, goal, regions, field)
    memory.alphas[:] = regions.gains * weights
    paper_law.step(
        state.quaternion,
        state.velocity_body,
        memory.desired_quaternion,
        field.goal_value[0],
        field.goal_gradient[0],
        field.values,
        field.gradients,
        memory.alphas,
        gains,
        memory.period[0],
        memory.estimate,
        forces,
    )


def make_memory(desired_quaternion: Array, period: Array, n_regions: int) -> IsmailDunniganMemory:
    """Return the memory before the first step; `period` [s] has shape (1,)."""
    return IsmailDunniganMemory(
        desired_quaternion=desired_quaternion,
        period=period,
        estimate=np.zeros(4),
        report=np.zeros(0),
        field=empty_field(n_regions),
        alphas=np.zeros(n_regions),
    )


class IsmailDunniganLaw(WrenchLaw):
    """The paper's law: a wrench without limits.

    Examples
    --------
    >>> from controller import Gains, IsmailDunniganLaw
    >>> law = IsmailDunniganLaw(Gains(), desired_quaternion=[1.0, 0.0, 0.0, 0.0], period=0.01, n_regions=2)
    >>> law.estimate
    array([0., 0., 0., 0.])
    """

    function = staticmethod(step)
    make_memory = staticmethod(make_memory)
    gains_type = Gains
    above_zero = ("k_p1", "k_q", "gamma")


LAW = IsmailDunniganLaw
