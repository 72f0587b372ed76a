"""Adaptive set-point control through the transposed Jacobian, in the manner of Sun and Cheah."""

# Y. C. Sun and C. C. Cheah, "Adaptive control schemes for autonomous underwater vehicle", Robotica 27, 2009, the
# paper's reference [1]:
#
#     tau = -J^T K_p s(e) - K_v nu + Z(eta) phi-hat,    d(phi-hat)/dt = -L Z^T (nu + sigma J^T s(e))
#
# with s() saturated and only the four numbers of the restoring forces (12) adapted: the law that the paper's one
# (25)-(29) generalizes to regions. The article was not at hand; this is its form as the paper's law shows it, with
# attitude errors as quaternions, where J is blkdiag(R, I). Ours are the bounds of the estimate and the push of the
# regions, which is not part of the adaptation.

from __future__ import annotations

from typing import NamedTuple

from controller.law import Array, VehicleState, WrenchLaw
from controller.potential_field import PotentialMemory, clip_estimate, write_drive, write_set_point_wrench
from controller.quaternion import rotation_matrix
from controller.regions.region_set import PackedRegions
from controller.restoring import regressor
from controller.stack_array import Vector6


class SunCheahGains(NamedTuple):
    """Defaults: by ``python -m benchmarks baselines --draws 40 --seed 0``, where no other source is given."""

    k_p1: float = 156.1  # N/m, gain of the position error
    k_p2: float = 36.0  # N m, gain of the attitude error, section VII
    k_v1: float = 153.2  # N s/m, damping of translation
    k_v2: float = 40.0  # N m s/rad, damping of rotation, section VII
    sigma_p: float = 0.0375  # 1/s, weight of position in the adaptation
    sigma_a: float = 0.9  # rad/s, weight of attitude in the adaptation, section VII
    gamma: float = 1.363  # s2/kg, s2/(kg m2): L = I / gamma
    bound: float = 30.5  # N, bound of the estimate of W - B
    bound_moment: float = 65.0  # N m, bound of the other estimates: above the righting moments of ODIN-like vehicles
    limit: float = 184.2  # N, greatest pull to the set point
    inset: float = 0.5  # m, clearance of the set point within the goal region: the center of the scenes' goals
    repulsion: float = 222.3  # N/m, slope of the push of a region of gain 1
    reach: float = 1.499  # m, clearance at which regions begin to push


def step(
    state: VehicleState,
    goal: PackedRegions,
    regions: PackedRegions,
    weights: Array,
    gains: SunCheahGains,
    memory: PotentialMemory,
    forces: Vector6,
) -> None:
    """Write the forces as `CompiledLaw.step`; all regions push in full, whatever their weights."""
    R, Z, estimate = rotation_matrix(state.quaternion), regressor(state.quaternion), memory.estimate  # (3), (12)
    e_att = write_set_point_wrench(state, goal, regions, gains, memory, R, forces)
    forces += Z @ estimate
    # the estimate
    write_drive(state, R, e_att, gains.sigma_p, gains.sigma_a, memory)
    estimate -= memory.period / gains.gamma * (Z.T @ memory.drive)
    clip_estimate(estimate[:1], gains.bound)
    clip_estimate(estimate[1:4], gains.bound_moment)


class SunCheahLaw(WrenchLaw):
    """Adaptive set-point control through the transposed Jacobian, with the push of regions."""

    function = staticmethod(step)
    memory_type = PotentialMemory
    gains_type = SunCheahGains
    gains_for = "odin"
    above_zero = ("k_p1", "gamma")


LAW = SunCheahLaw
