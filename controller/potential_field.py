"""Common parts of the laws for comparison: a bounded pull to the goal, the push of all other regions, and damping."""

# Their sources have no obstacles and no arbiter. Here each law gets the potential force (22) of every secondary region,
# with a weight of 1. A region is grown by a `reach`, so that it pushes before the vehicle is at its surface, and g is
# the signed distance to the grown region, whose gradient has the length 1, as (19) requires.

from __future__ import annotations

import warnings
from typing import Annotated, Any

import numpy as np

from controller.law import Array, LawMemory, VehicleState
from controller.linear_algebra import norm
from controller.paper_law import positive_part
from controller.quaternion import error
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import PackedRegions, evaluate_packed
from controller.stack_array import Matrix3, Number, Rows3, Shape, Vector3, Vector6, VectorN
from controller.state import State

_ATTITUDE = FIRST_OF_ATTITUDE  # first kind of region that depends on attitude
GoalRow = Annotated[Array, Shape(1, 3)]
Parameters9 = Annotated[Array, Shape(9)]


class Field(State):
    """Work arrays for the evaluation of n regions, and the results."""

    goal_value: Number  # g of the goal
    goal_gradient: GoalRow  # dg/dp, NED
    goal_turning: GoalRow  # dg/dtheta, body frame
    goal_clearance: Number  # m
    values: VectorN  # g of the other regions
    gradients: Rows3  # dg/dp, NED
    rotation_gradients: Rows3  # dg/dtheta, body frame
    clearances: VectorN  # m or rad
    error: Vector3  # position error towards the goal, NED
    push: Vector3  # N, NED, sum of the forces of all other regions


class PotentialMemory(LawMemory):
    """State between steps, and work arrays, of a law for comparison."""

    theta: Parameters9  # parameters of a law with other ones than phi
    drive: Vector6  # what drives the adaptation
    field: Field


def write_set_point_wrench(
    state: VehicleState, goal: PackedRegions, regions: PackedRegions, gains: Any, memory: PotentialMemory, R: Matrix3,
    forces: Vector6,
) -> Vector3:  # fmt: skip
    """Write the wrench [N, N m] of pull, push and damping; return the attitude error (23)."""
    # with gains that have limit, inset, repulsion, reach, k_p1, k_p2, k_v1 and k_v2
    field = memory.field
    evaluate_field(state, goal, regions, gains.repulsion, gains.reach, field)
    set_point_error(field, gains.inset, max_pull(gains, memory.speed_limit) / gains.k_p1)
    e_att = error(memory.desired_quaternion, state.quaternion)[1:]  # (23)
    forces[:] = damping(state.velocity_body, e_att, gains.k_p2, gains.k_v1, gains.k_v2)
    forces[:3] -= gains.k_p1 * (R.T @ field.error)
    forces[:3] += R.T @ field.push
    return e_att


def max_pull(gains: Any, speed: float) -> float:
    """Return the greatest pull to the set point [N]: at a speed [m/s], damping alone is as strong."""
    limit: float = gains.limit
    by_speed: float = gains.k_v1 * speed  # NaN without damping
    return by_speed if by_speed < limit else limit


def write_drive(
    state: VehicleState, R: Matrix3, e_att: Vector3, sigma_p: float, sigma_a: float, memory: PotentialMemory
) -> None:
    """Write nu + [sigma_p R^T e; sigma_a e_att], which drives an adaptation, into `memory.drive`."""
    off = np.concatenate((sigma_p * (R.T @ memory.field.error), sigma_a * e_att))
    memory.drive = state.velocity_body + off


def evaluate_field(
    state: VehicleState, goal: PackedRegions, regions: PackedRegions, repulsion: float, reach: float, field: Field
) -> None:
    """Evaluate all regions at a pose, and sum up the push of those that depend on position alone; repulsion [N/m]."""
    # Units of arguments: reach [m]
    evaluate_regions(state, goal, regions, field)
    field.push[:] = 0.0
    for i in range(field.values.size):
        if regions.kinds[i] >= _ATTITUDE:
            continue
        add_along(
            field.gradients[i], -repulsion * regions.gains[i] * positive_part(reach - field.clearances[i]), field.push
        )


def evaluate_regions(state: VehicleState, goal: PackedRegions, regions: PackedRegions, field: Field) -> None:
    """Evaluate all regions at a pose, and write everything but `error` and `push`."""
    p, e = state.position, state.quaternion
    evaluate_packed(goal, p, e, field.goal_value, field.goal_gradient, field.goal_turning, field.goal_clearance)
    evaluate_packed(regions, p, e, field.values, field.gradients, field.rotation_gradients, field.clearances)


def add_along(gradient: Vector3, length: float, total: Vector3) -> None:
    """Add a vector of a length [N] along a gradient to `total`; nothing if the gradient is zero."""
    size = norm(gradient)
    if not size <= 0.0:
        total += length / size * gradient


def set_point_error(field: Field, inset: float, most: float) -> None:
    """Write the vector from the set point to the vehicle [m, NED] into `field.error`, shortened to a length."""
    # Units of arguments: inset [m]; most [m]
    # The set point is the nearest point whose clearance within the goal region is `inset`: the center of a sphere of
    # that radius. No region's deepest point is needed, so that every shape can be a goal.
    field.error[:] = 0.0
    add_along(field.goal_gradient[0], positive_part(inset - field.goal_clearance[0]), field.error)
    shorten(field.error, most)


def shorten(vector: Vector3, most: float) -> None:
    """Scale a vector in place so that it is no longer than `most`; NaN stays."""
    size = norm(vector)
    if size > most:
        vector *= most / size


def damping(nu: Vector6, e_att: Vector3, k_p2: float, k_v1: float, k_v2: float) -> Vector6:
    """Return the part of (25) that every law has [N, N m]: -K_v nu, and -k_p2 times the attitude error (26)."""
    return np.concatenate((-k_v1 * nu[:3], -k_p2 * e_att - k_v2 * nu[3:]))


def clip_estimate(estimate: Array, bound: float) -> None:
    """Clip numbers of an estimate in place to +-`bound`; NaN stays."""
    # This projection prevents windup of the estimate while an obstacle holds the vehicle back.
    estimate[:] = np.clip(estimate, -bound, bound)


def __getattr__(name: str) -> object:
    if name != "empty_field":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    warnings.warn("empty_field(n_regions) is now Field(n=n_regions)", DeprecationWarning, stacklevel=2)
    return lambda n_regions: Field(n=n_regions)
