"""Laws as objects: what the controller keeps between steps, behind one interface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from controller import printed_law
from controller.errors import LawError
from controller.printed_law import Gains, check_gains

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class VehicleState:
    """What is measured of the vehicle."""

    position: Array  # (3,) m, NED
    quaternion: Array  # (4,) from body to world
    velocity_body: Array  # (6,) m/s, rad/s


@dataclass(frozen=True, eq=False)
class RegionValues:
    """What `controller.regions.PackedRegions.evaluate` says of n regions."""

    values: Array  # (n,) g_i
    gradients: Array  # (n, 3) dg_i/dp, world frame
    clearances: Array  # (n,) m, negative where violated


class Law(Protocol):
    """State, regions and weights in; a body wrench out."""

    estimate: Array  # (4,) phi-hat [N, N m]

    def step(self, state: VehicleState, goal: RegionValues, regions: RegionValues, alphas: Array, tau: Array) -> None:
        """Write the wrench for the coming control period, shape (6,) [N, N m], into `tau`."""
        ...


class PrintedLaw:
    """The printed law (25)-(29), see `controller.printed_law`.

    Parameters
    ----------
    gains : Gains
        Of the law.
    desired_quaternion : array_like, shape (4,)
        Attitude to be kept, from body to world.
    period : float
        Control period [s].

    Raises
    ------
    LawError
        If gains, attitude or period cannot be.
    """

    def __init__(self, gains: Gains, desired_quaternion: Array, period: float) -> None:
        if not 0.0 < period < np.inf:
            raise LawError(f"control period is {period} s, expected a finite number above 0")
        desired = np.array(desired_quaternion, dtype=float)
        if desired.shape != (4,) or not abs(np.linalg.norm(desired) - 1.0) < 1e-6:
            raise LawError(f"desired quaternion is {desired}, expected four numbers of length 1")
        self.gains = check_gains(gains)
        self.estimate: Array = np.zeros(4)
        self._desired = desired
        self._period = period

    def step(self, state: VehicleState, goal: RegionValues, regions: RegionValues, alphas: Array, tau: Array) -> None:
        """Write the wrench for the coming control period into `tau`, and carry the estimate over it.

        Parameters
        ----------
        state : VehicleState
            As measured now.
        goal : RegionValues
            Of the primary region alone.
        regions : RegionValues
            Of the secondary regions.
        alphas : ndarray, shape (n,)
            Gain times weight of each secondary region.
        tau : ndarray, shape (6,)
            Receives the wrench [N, N m], body frame.
        """
        printed_law.step(
            state.quaternion,
            state.velocity_body,
            self._desired,
            goal.values[0],
            goal.gradients[0],
            regions.values,
            regions.gradients,
            alphas,
            self.gains,
            self._period,
            self.estimate,
            tau,
        )
