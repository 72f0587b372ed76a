"""Sliding-mode control of the velocity, with a reference from a potential field.

    s = nu - nu_ref,   tau = -K sat(s / layer)

The reference velocity points towards the goal and away from regions. The law needs no model of the vehicle.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from controller.law import Array, LawMemory, VehicleState, WrenchLaw
from controller.potential_field import Field, evaluate_field, set_point_error
from controller.quaternion import error, rotation_matrix
from controller.regions.region_set import PackedRegions


class SlidingModeGains(NamedTuple):
    """Defaults: chosen by hand for ODIN."""

    slope: float = 0.5  # 1/s, reference velocity per distance to the set point
    speed: float = 0.5  # m/s, maximum reference velocity towards the goal
    turning: float = 0.5  # 1/s, reference angular velocity per attitude error
    force: float = 400.0  # N, K
    moment: float = 200.0  # N m, K
    layer: float = 0.2  # m/s or rad/s, boundary layer: below it the force is proportional to s
    inset: float = 0.5  # m, clearance of the set point within the goal region
    repulsion: float = 0.02  # 1/s, velocity away from a region of gain 1 per depth within `reach`
    reach: float = 1.0  # m, clearance below which regions repel


class SlidingModeMemory(LawMemory):
    """Work arrays; nothing else is kept between steps."""

    field: Field


def step(
    state: VehicleState,
    goal: PackedRegions,
    regions: PackedRegions,
    weights: Array,
    gains: SlidingModeGains,
    memory: SlidingModeMemory,
    forces: Array,
) -> None:
    """Compute the wrench as `CompiledLaw.step` does; all regions repel in full, whatever their weights."""
    R, field = rotation_matrix(state.quaternion), memory.field
    evaluate_field(state, goal, regions, gains.repulsion, gains.reach, field)
    set_point_error(field, gains.inset, gains.speed / gains.slope)
    e_att = error(memory.desired_quaternion, state.quaternion)[1:]
    nu_ref = np.concatenate((R.T @ (field.push - gains.slope * field.error), -gains.turning * e_att))
    s = np.clip((state.velocity_body - nu_ref) / gains.layer, -1.0, 1.0)
    forces[:3], forces[3:] = -gains.force * s[:3], -gains.moment * s[3:]


class SlidingModeLaw(WrenchLaw):
    """Sliding-mode law."""

    function = staticmethod(step)
    memory_type = SlidingModeMemory
    gains_type = SlidingModeGains
    above_zero = ("slope", "layer")


LAW = SlidingModeLaw
