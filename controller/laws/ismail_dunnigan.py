"""The paper's law (25)-(29) as a law among others, see `controller.paper_law`."""

from __future__ import annotations

from controller import paper_law
from controller.law import Array, LawMemory, VehicleState, WrenchLaw
from controller.paper_law import Gains
from controller.potential_field import Field, evaluate_regions
from controller.regions.region_set import PackedRegions
from controller.stack_array import VectorN


class IsmailDunniganMemory(LawMemory):
    """State between steps, and work arrays for the regions."""

    field: Field  # regions; its error and push are not used
    alphas: VectorN  # gains of the regions times their weights


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
    memory.alphas = regions.gains * weights
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
        memory.period,
        memory.estimate,
        forces,
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
    memory_type = IsmailDunniganMemory
    gains_type = Gains
    above_zero = ("k_p1", "k_q", "gamma")


LAW = IsmailDunniganLaw
