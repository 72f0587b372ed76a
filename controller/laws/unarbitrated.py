"""The paper's law (25)-(29) without its arbiter: every region has its full weight at all times."""

# As every law for comparison, it has the parts that the paper's law lacks for real thrusters: a bound on the pull of
# the primary region, a margin within that region, regions that push from a `reach` on, and bounds on the estimate. All
# else is the paper's.

from __future__ import annotations

from typing import NamedTuple

from controller import paper_law
from controller.law import Array, VehicleState, WrenchLaw
from controller.paper_law import Gains, primary_error
from controller.potential_field import PotentialMemory, clip_estimate, evaluate_field, shorten
from controller.quaternion import error, rotation_matrix
from controller.regions.region_set import PackedRegions


class UnarbitratedGains(NamedTuple):
    """Defaults: by ``python -m benchmarks baselines --draws 40 --seed 0``, where no other source is given."""

    k_p1: float = 506.5  # N/m3, gain of the primary region (16)
    k_p2: float = 36.0  # N m, gain of the attitude error (26), section VII
    k_v1: float = 27.32  # N s/m, damping of translation (26)
    k_v2: float = 40.0  # N m s/rad, damping of rotation (26), section VII
    sigma_p: float = 1.661  # 1/(m2 s), weight of position in the adaptation (27)
    sigma_a: float = 0.9  # rad/s, weight of attitude in the adaptation (27), section VII
    gamma: float = 9.969  # s2/kg, s2/(kg m2): Gamma = gamma I (27)
    bound: float = 35.35  # N, bound of the estimate of W - B
    bound_moment: float = 65.0  # N m, bound of the other estimates: above the righting moments of ODIN-like vehicles
    limit: float = 28.25  # N, greatest pull of the primary region
    margin: float = 0.1508  # m2: the pull ends where f of a sphere is -margin
    repulsion: float = 2814.0  # N/m, slope of the push of a region of gain 1
    reach: float = 0.6542  # m, clearance at which regions begin to push


def step(
    state: VehicleState,
    goal: PackedRegions,
    regions: PackedRegions,
    weights: Array,
    gains: UnarbitratedGains,
    memory: PotentialMemory,
    forces: Array,
) -> None:
    """Write the forces as `CompiledLaw.step`; all regions push in full, whatever their weights."""
    field, estimate = memory.field, memory.estimate
    k_q = 1.0  # cancels
    g = Gains(gains.k_p1, gains.k_p2, k_q, gains.k_v1, gains.k_v2, gains.sigma_p, gains.sigma_a, gains.gamma)
    evaluate_field(state, goal, regions, gains.repulsion, gains.reach, field)
    field.error = primary_error(field.goal_value[0] + gains.margin, field.goal_gradient[0])  # (20)
    shorten(field.error, gains.limit / gains.k_p1)
    e_s = -field.push / k_q  # (21), (22)
    e_att, R = error(memory.desired_quaternion, state.quaternion)[1:], rotation_matrix(state.quaternion)  # (23), (3)
    paper_law.apply(field.error, e_s, e_att, R, state.velocity_body, g, memory.period, estimate, forces)  # (25), (27)
    clip_estimate(estimate[:1], gains.bound)
    clip_estimate(estimate[1:4], gains.bound_moment)


class UnarbitratedLaw(WrenchLaw):
    """The paper's law with all weights on, within bounds."""

    function = staticmethod(step)
    memory_type = PotentialMemory
    gains_type = UnarbitratedGains
    gains_for = "odin"
    above_zero = ("k_p1", "gamma")


LAW = UnarbitratedLaw
