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

from typing import Annotated, NamedTuple

from controller.law import Array, VehicleState, WrenchLaw
from controller.potential_field import PotentialMemory, clip_estimate, write_drive, write_set_point_wrench
from controller.quaternion import rotation_matrix, skew
from controller.regions.region_set import PackedRegions
from controller.stack_array import Matrix3, Shape, Vector6, zeros

Regressor = Annotated[Array, Shape(6, 9)]


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
    inset: float = 0.5  # m, clearance of the set point within the goal region: the center of the scenes' goals
    repulsion: float = 222.3  # N/m, slope of the push of a region of gain 1
    reach: float = 1.499  # m, clearance at which regions begin to push


def regressor(R: Matrix3) -> Regressor:
    """Return Phi of a rotation."""
    Phi = zeros(6, 9)
    Phi[3:, :3], Phi[:3, 3:6], Phi[3:, 6:] = skew(R[2]), R.T, R.T
    return Phi


def step(
    state: VehicleState,
    goal: PackedRegions,
    regions: PackedRegions,
    weights: Array,
    gains: AntonelliGains,
    memory: PotentialMemory,
    forces: Vector6,
) -> None:
    """Write the forces as `CompiledLaw.step`; all regions push in full, whatever their weights."""
    R, theta = rotation_matrix(state.quaternion), memory.theta
    Phi = regressor(R)
    e_att = write_set_point_wrench(state, goal, regions, gains, memory, R, forces)
    forces += Phi @ theta
    # the estimate
    write_drive(state, R, e_att, gains.lambda_p, gains.lambda_a, memory)
    change = memory.period * (Phi.T @ memory.drive)
    theta[:3] -= change[:3] / gains.k_theta_moment
    theta[3:6] -= change[3:6] / gains.k_theta
    theta[6:] -= change[6:] / gains.k_theta_moment
    clip_estimate(theta[:3], gains.bound_moment)
    clip_estimate(theta[3:6], gains.bound)
    clip_estimate(theta[6:9], gains.bound_moment)
    memory.estimate[0], memory.estimate[1:] = -theta[5], theta[:3]


class AntonelliLaw(WrenchLaw):
    """Adaptive set-point control with restoring forces and current, with the push of regions."""

    function = staticmethod(step)
    memory_type = PotentialMemory
    gains_type = AntonelliGains
    gains_for = "odin"
    above_zero = ("k_p1", "k_theta", "k_theta_moment")


LAW = AntonelliLaw
