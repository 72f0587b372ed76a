"""Antonelli's reduced adaptive law: PD control that adapts to restoring forces and current, nine parameters in all."""

# G. Antonelli, "On the use of adaptive/integral actions for six-degrees-of-freedom control of autonomous underwater
# vehicles", IEEE J. Oceanic Eng. 32(2), 2007, and "Underwater Robots", Springer: the law in mixed earth-fixed and
# vehicle-fixed frames, for a set point,
#
#     tau = -K_P y - K_D nu + Phi theta-hat,    d(theta-hat)/dt = -K_theta^-1 Phi^T s,    s = nu + Lambda y
#     y = [R^T sat(p - p_d); e_eps],    Phi = [0 R^T 0; S(R^T e3) 0 R^T]  (6 by 9)
#
# theta holds the three first moments of weight and buoyancy, which turn with the vehicle, and a force and a moment that
# are constant in the world, which is how he takes the effect of a steady current. The net weight W - B is constant in
# the world too, and so is a part of that force: with a parameter of its own there would be ten, two of them the same.
# Neither article nor book was at hand. This is the law as we know it, and the division 3 + 3 + 3 follows from that
# equality, not from a page. Ours are the saturation, the bounds of the estimate, and the push of the regions, which is
# not part of the adaptation.

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from controller.law import Array, VehicleState, WrenchLaw
from controller.potential_field import (
    Field,
    add_turned,
    clip_estimate,
    empty_field,
    evaluate_field,
    set_point_error,
    write_damping,
)
from controller.quaternion import down_parts, error_parts, write_rotation
from controller.regions.region_set import PackedRegions
from controller.stack_array import zeros


class AntonelliGains(NamedTuple):
    """Defaults: by ``python -m benchmarks baselines --draws 40 --seed 0``, where no other source is given."""

    k_p1: float = 156.1  # N/m, K_P of position
    k_p2: float = 36.0  # N m, K_P of attitude, section VII
    k_v1: float = 153.2  # N s/m, K_D of translation
    k_v2: float = 40.0  # N m s/rad, K_D of rotation, section VII
    lambda_p: float = 0.0247  # 1/s, Lambda of position
    lambda_a: float = 0.9  # rad/s, Lambda of attitude: sigma_a of section VII
    k_theta: float = 2.348  # s2/kg, K_theta of the force
    k_theta_moment: float = 2.0  # s2/(kg m2), K_theta of the moments: gamma of section VII
    bound: float = 19.2  # N, bound of each component of the force
    bound_moment: float = 65.0  # N m, bound of each component of the moments: above ODIN-like righting moments
    limit: float = 184.2  # N, greatest pull to the set point
    inset: float = 0.5  # m, clearance of the set point within the goal region: the centre of the scenes' goals
    repulsion: float = 222.3  # N/m, slope of the push of a region of gain 1
    reach: float = 1.499  # m, clearance at which regions begin to push


class AntonelliMemory(NamedTuple):
    """State between steps, and work arrays."""

    desired_quaternion: Array  # (4,)
    period: Array  # (1,) s
    theta: Array  # (9,) first moments [N m], force [N, NED], moment [N m, NED]
    estimate: Array  # (4,) phi-hat from theta: the current's vertical force counts as weight
    report: Array  # (0,)
    drive: Array  # (6,) the vector s
    field: Field


def write_regressor(quaternion: Array, R: Array, Phi: Array) -> None:
    """Write Phi, shape (6, 9), of a unit quaternion, shape (4,), and its rotation, shape (3, 3), over zeros."""
    x, y, z = down_parts(quaternion)
    Phi[3, 1], Phi[3, 2] = -z, y
    Phi[4, 0], Phi[4, 2] = z, -x
    Phi[5, 0], Phi[5, 1] = -y, x
    for i in range(3):
        for j in range(3):
            Phi[i, 3 + j] = Phi[3 + i, 6 + j] = R[j, i]


def step(
    state: VehicleState,
    goal: PackedRegions,
    regions: PackedRegions,
    weights: Array,
    gains: AntonelliGains,
    memory: AntonelliMemory,
    forces: Array,
) -> None:
    """Write the forces as `CompiledLaw.step`; all regions push in full, whatever their weights."""
    R, Phi = zeros(3, 3), zeros(6, 9)
    write_rotation(state.quaternion, R)
    write_regressor(state.quaternion, R, Phi)
    field, drive, theta = memory.field, memory.drive, memory.theta
    evaluate_field(state, goal, regions, gains.repulsion, gains.reach, field)
    set_point_error(field, gains.inset, gains.limit / gains.k_p1)
    e_att = error_parts(memory.desired_quaternion, state.quaternion)[1:]  # (23)
    # the wrench
    write_damping(state.velocity_body, e_att, gains.k_p2, gains.k_v1, gains.k_v2, forces)
    add_turned(R, field.error, -gains.k_p1, forces)
    add_turned(R, field.push, 1.0, forces)
    for i in range(6):
        for j in range(9):
            forces[i] += Phi[i, j] * theta[j]
    # the estimate
    for i in range(6):
        drive[i] = state.velocity_body[i]
    add_turned(R, field.error, gains.lambda_p, drive)
    for i in range(3):
        drive[3 + i] += gains.lambda_a * e_att[i]
    for j in range(9):
        k_theta = gains.k_theta if 3 <= j < 6 else gains.k_theta_moment
        for i in range(6):
            theta[j] -= memory.period[0] / k_theta * Phi[i, j] * drive[i]
    clip_estimate(theta, 0, 3, gains.bound_moment)
    clip_estimate(theta, 3, 6, gains.bound)
    clip_estimate(theta, 6, 9, gains.bound_moment)
    memory.estimate[0] = -theta[5]
    for i in range(3):
        memory.estimate[1 + i] = theta[i]


def make_memory(desired_quaternion: Array, period: Array, n_regions: int) -> AntonelliMemory:
    """Return the memory before the first step; `period` [s] has shape (1,)."""
    return AntonelliMemory(
        desired_quaternion=desired_quaternion,
        period=period,
        theta=np.zeros(9),
        estimate=np.zeros(4),
        report=np.zeros(0),
        drive=np.zeros(6),
        field=empty_field(n_regions),
    )


class AntonelliLaw(WrenchLaw):
    """Adaptive set-point control with restoring forces and current, with the push of regions."""

    function = staticmethod(step)
    make_memory = staticmethod(make_memory)
    gains_type = AntonelliGains
    above_zero = ("k_p1", "k_theta", "k_theta_moment")


LAW = AntonelliLaw
