"""PD control to a set point with gravity compensation, the simplest law for comparison."""

#     tau = -k_p1 R^T sat(p - p_d) - k_p2 e_eps - K_v nu + g-hat
#
# Takegaki and Arimoto's regulator (ASME J. Dyn. Syst. Meas. Control 103, 1981) for a vehicle, with attitude in
# quaternions as in Fjellstad and Fossen (IEEE Oceans, 1994), the proportional action saturated, and the push of the
# regions. g-hat compensates weight and buoyancy as far as they are given. No law is given either (`VehicleModel`), so
# that g-hat is that of a neutral vehicle, zero, and the vehicle droops by (W - B) / k_p1. Integral action would make it
# another law.

from __future__ import annotations

from typing import NamedTuple

from controller.law import Array, VehicleState, WrenchLaw
from controller.potential_field import PotentialMemory, write_set_point_wrench
from controller.quaternion import rotation_matrix
from controller.regions.region_set import PackedRegions
from controller.stack_array import Vector6


class PdGains(NamedTuple):
    """Defaults: by ``python -m benchmarks baselines --draws 120 --seed 0``, where no other source is given."""

    k_p1: float = 155.9  # N/m, gain of the position error
    k_p2: float = 36.0  # N m, gain of the attitude error, section VII
    k_v1: float = 142.7  # N s/m, damping of translation
    k_v2: float = 40.0  # N m s/rad, damping of rotation, section VII
    limit: float = 164.1  # N, greatest pull to the set point
    inset: float = 0.5  # m, clearance of the set point within the goal region: the center of the scenes' goals
    repulsion: float = 223.8  # N/m, slope of the push of a region of gain 1
    reach: float = 1.354  # m, clearance at which regions begin to push


def step(
    state: VehicleState,
    goal: PackedRegions,
    regions: PackedRegions,
    weights: Array,
    gains: PdGains,
    memory: PotentialMemory,
    forces: Vector6,
) -> None:
    """Write the forces as `CompiledLaw.step`; all regions push in full, whatever their weights."""
    write_set_point_wrench(state, goal, regions, gains, memory, rotation_matrix(state.quaternion), forces)


class PdLaw(WrenchLaw):
    """PD control to a set point, with the push of regions."""

    function = staticmethod(step)
    memory_type = PotentialMemory
    gains_type = PdGains
    gains_for = "odin"
    above_zero = ("k_p1",)
    takes_speed = True


LAW = PdLaw
