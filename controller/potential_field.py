"""Common parts of the laws for comparison: a bounded pull to the goal, the push of all other regions, and damping."""

# Their sources have no obstacles and no arbiter. Here each law gets the potential force (22) of every secondary region,
# with a weight of 1. A region is grown by a `reach`, so that it pushes before the vehicle is at its surface, and g is
# the signed distance to the grown region, whose gradient has the length 1, as (19) requires.

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from controller.arithmetic import length3
from controller.law import Array, VehicleState
from controller.paper_law import positive_part
from controller.quaternion import Vector3, error_parts, write_rotation
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import PackedRegions, evaluate_packed

_ATTITUDE = FIRST_OF_ATTITUDE  # first kind of region that depends on attitude


class Field(NamedTuple):
    """Work arrays for the evaluation of regions, and the results."""

    goal_value: Array  # (1,) g of the goal
    goal_gradient: Array  # (1, 3) dg/dp, NED
    goal_turning: Array  # (1, 3) dg/dtheta, body frame
    goal_clearance: Array  # (1,) m
    values: Array  # (n,) g of the other regions
    gradients: Array  # (n, 3) dg/dp, NED
    rotation_gradients: Array  # (n, 3) dg/dtheta, body frame
    clearances: Array  # (n,) m or rad
    error: Array  # (3,) position error towards the goal, NED
    push: Array  # (3,) N, NED, sum of the forces of all other regions


def empty_field(n_regions: int) -> Field:
    """Return the arrays for `n_regions` secondary regions."""
    return Field(
        goal_value=np.zeros(1),
        goal_gradient=np.zeros((1, 3)),
        goal_turning=np.zeros((1, 3)),
        goal_clearance=np.zeros(1),
        values=np.zeros(n_regions),
        gradients=np.zeros((n_regions, 3)),
        rotation_gradients=np.zeros((n_regions, 3)),
        clearances=np.zeros(n_regions),
        error=np.zeros(3),
        push=np.zeros(3),
    )


class PotentialMemory(NamedTuple):
    """State between steps, and work arrays, of a law for comparison."""

    desired_quaternion: Array  # (4,)
    period: Array  # (1,) s
    estimate: Array  # (4,) phi-hat [N, N m]; zeros of a law that estimates nothing
    report: Array  # (0,)
    theta: Array  # (9,) parameters of a law with other ones than phi
    drive: Array  # (6,) what drives the adaptation
    field: Field


def make_memory(desired_quaternion: Array, period: Array, n_regions: int) -> PotentialMemory:
    """Return the memory before the first step; `period` [s] has shape (1,)."""
    field = empty_field(n_regions)
    return PotentialMemory(desired_quaternion, period, np.zeros(4), np.zeros(0), np.zeros(9), np.zeros(6), field)


def write_set_point_wrench(
    state: VehicleState, goal: PackedRegions, regions: PackedRegions, gains: Any, memory: PotentialMemory, R: Array,
    forces: Array,
) -> Vector3:  # fmt: skip
    """Write the wrench [N, N m] of pull, push and damping, and rotation `R`, (3, 3); return the attitude error (23)."""
    # with gains that have limit, inset, repulsion, reach, k_p1, k_p2, k_v1 and k_v2
    field = memory.field
    write_rotation(state.quaternion, R)
    evaluate_field(state, goal, regions, gains.repulsion, gains.reach, field)
    set_point_error(field, gains.inset, gains.limit / gains.k_p1)
    e_att = error_parts(memory.desired_quaternion, state.quaternion)[1:]  # (23)
    write_damping(state.velocity_body, e_att, gains.k_p2, gains.k_v1, gains.k_v2, forces)
    add_turned(R, field.error, -gains.k_p1, forces)
    add_turned(R, field.push, 1.0, forces)
    return e_att


def write_drive(
    state: VehicleState, R: Array, e_att: Vector3, sigma_p: float, sigma_a: float, memory: PotentialMemory
) -> None:
    """Write nu + [sigma_p R^T e; sigma_a e_att], which drives an adaptation, into `memory.drive`."""
    for i in range(6):
        memory.drive[i] = state.velocity_body[i]
    add_turned(R, memory.field.error, sigma_p, memory.drive)
    for i in range(3):
        memory.drive[3 + i] += sigma_a * e_att[i]


def evaluate_field(
    state: VehicleState, goal: PackedRegions, regions: PackedRegions, repulsion: float, reach: float, field: Field
) -> None:
    """Evaluate all regions at a pose, and sum up the push of those that depend on position alone; repulsion [N/m]."""
    # with reach [m]
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


def add_along(gradient: Array, length: float, total: Array) -> None:
    """Add a vector of a length [N] along a gradient, shape (3,), to `total`; nothing if the gradient is zero."""
    norm = length3(gradient[0], gradient[1], gradient[2])
    if not norm <= 0.0:
        for axis in range(3):
            total[axis] += length / norm * gradient[axis]


def set_point_error(field: Field, inset: float, most: float) -> None:
    """Write the vector from the set point to the vehicle [m, NED] into `field.error`, shortened to a length."""
    # with inset [m], most [m]
    # The set point is the nearest point whose clearance within the goal region is `inset`: the center of a sphere of
    # that radius. No region's deepest point is needed, so that every shape can be a goal.
    field.error[:] = 0.0
    add_along(field.goal_gradient[0], positive_part(inset - field.goal_clearance[0]), field.error)
    shorten(field.error, most)


def shorten(vector: Array, most: float) -> None:
    """Scale a vector, shape (3,), in place so that it is no longer than `most`; NaN stays."""
    norm = length3(vector[0], vector[1], vector[2])
    if norm > most:
        for axis in range(3):
            vector[axis] *= most / norm


def add_turned(R: Array, force: Array, factor: float, wrench: Array) -> None:
    """Add `factor` times R^T `force` to a body wrench, shape (6,) [N, N m]; the force, shape (3,) [N], is in NED."""
    for i in range(3):
        wrench[i] += factor * (R[0, i] * force[0] + R[1, i] * force[1] + R[2, i] * force[2])


def write_damping(
    velocity_body: Array, attitude_error: Vector3, k_p2: float, k_v1: float, k_v2: float, wrench: Array
) -> None:
    """Write the part of (25) that every law has, (6,) [N, N m]: -K_v nu, and -k_p2 times the attitude error (26)."""
    for i in range(3):
        wrench[i] = -k_v1 * velocity_body[i]
        wrench[3 + i] = -k_p2 * attitude_error[i] - k_v2 * velocity_body[3 + i]


def clip_estimate(estimate: Array, first: int, last: int, bound: float) -> None:
    """Clip the numbers from `first` up to, not including, `last` of an estimate to +-`bound`; NaN stays."""
    # This projection prevents windup of the estimate while an obstacle holds the vehicle back.
    for i in range(first, last):
        if abs(estimate[i]) > bound:
            estimate[i] = math.copysign(bound, estimate[i])
