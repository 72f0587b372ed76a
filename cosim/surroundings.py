"""The goal and the regions of a run: where each is now, and what they say of a pose."""

from __future__ import annotations

import numpy as np

from controller import VehicleState
from controller.regions import pack
from cosim.errors import RunError
from cosim.scenario import Scenario
from cosim.signals import Array


class Surroundings:
    """Goal and regions, moved by their velocities, or from outside where the scenario calls them streamed.

    Parameters
    ----------
    scenario : Scenario
        Which regions.

    Attributes
    ----------
    goal, regions : PackedRegions
        The primary region alone, and the n secondary ones, where they are now.
    """

    def __init__(self, scenario: Scenario) -> None:
        secondary = [region.region for region in scenario.regions]
        self.goal, self.regions = pack([scenario.goal_region]), pack(secondary)
        self._names = ["goal", *(region.name for region in secondary)]
        self._streamed = ["goal"] if scenario.goal_streamed else []
        self._streamed += [region.region.name for region in scenario.regions if region.streamed]
        self._moving = [self._names.index(name) for name in scenario.moving]
        # m, NED: where each would have been at time 0, had it always moved as it does now
        self._origins: Array = np.zeros((len(self._names), 3))
        self._gradients: Array = np.zeros((len(self._names), 3))
        self._turnings: Array = np.zeros((len(self._names), 3))

    def carry_to(self, time: float, shifts: Array) -> None:
        """Put all regions where they are at a time.

        Parameters
        ----------
        time : float
            [s].
        shifts : ndarray, shape (moving regions, 3)
            Receives how far each moving one is from where the scenario has it [m, NED].
        """
        for packed, origins in ((self.goal, self._origins[:1]), (self.regions, self._origins[1:])):
            packed.move_to(time)
            packed.shifts[:] += origins
        for i, at in enumerate(self._moving):
            shifts[i] = self.regions.shifts[at - 1] if at else self.goal.shifts[0]

    def evaluate(self, state: VehicleState, values: Array, clearances: Array) -> None:
        """Evaluate goal and regions at a pose.

        Parameters
        ----------
        state : VehicleState
            Its position and attitude count.
        values, clearances : ndarray, shape (n + 1,)
            Receive g and clearance, the goal's first.
        """
        p, e, gradients, turnings = state.position, state.quaternion, self._gradients, self._turnings
        self.goal.evaluate(p, e, values[:1], gradients[:1], turnings[:1], clearances[:1])
        self.regions.evaluate(p, e, values[1:], gradients[1:], turnings[1:], clearances[1:])

    def move(self, name: str, displacement: Array, velocity: Array, time: float) -> None:
        """Say where a streamed region is at a time, and how it goes on from there, as `Master.move_region` says."""
        if name not in self._streamed:
            known = ", ".join(self._streamed) or "none"
            raise RunError(f"region {name!r} cannot be moved, expected a streamed one: {known}")
        to, going = np.array(displacement, dtype=float), np.array(velocity, dtype=float)
        if to.shape != (3,) or going.shape != (3,) or not np.isfinite([to, going]).all():
            raise RunError(f"region {name!r}: moved to {to} m at {going} m/s, expected three finite numbers each")
        at = self._names.index(name)
        if at:
            self.regions.velocities[at - 1] = going
        else:
            self.goal.velocities[0] = going
        self._origins[at] = to - going * time
