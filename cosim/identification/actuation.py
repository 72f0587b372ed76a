"""The wrench that commands put on the body, step by step, and how it depends on lag and thrust."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from cosim.errors import IdentificationError
from cosim.identification.command_errors import Impulses, open_impulses
from cosim.identification.log import Log
from plant_fmu.vehicle import Vehicle

Array = NDArray[np.float64]

_LEAST_LAG = 1e-4  # s; a shorter one is none


@dataclass(frozen=True)
class Actuation:
    """Wrenches that are linear over each step of a grid: mean and change from begin to end, and their derivatives."""

    wrench: Array  # (steps, 2, 6) N, N m
    by_lag: Array  # (steps, 2, 6) N/s, N m/s, by the time constant of all thrusters
    by_scale: Array  # (thrusters, steps, 2, 6) N, N m, by a factor of each thruster
    by_loss: Array  # (thrusters, steps, 2, 6) N, N m, by the part that each thruster lacks backward
    lag: float  # s, time constant of all thrusters


class CommandedForces:
    """The forces that the commands of a run ask for, after limits, dead band and curve.

    Parameters
    ----------
    log : Log
        Of the run.
    vehicle : Vehicle
        Its limits, dead bands and curves are those of the commands.
    step : float
        Of the grid, which begins with the first command [s].

    Raises
    ------
    IdentificationError
        If a thruster has a rate limit, which is not a lag.
    """

    def __init__(self, log: Log, vehicle: Vehicle, step: float) -> None:
        if vehicle.thrust_rate_limit.any():
            raise IdentificationError(f"{vehicle.name}: thrusters.rate_limit is above 0, expected none")
        self.step, self.start = step, float(log.times[0])
        self.steps = max(1, math.floor((log.times[-1] - self.start) / step))
        forces = np.concatenate([steady_forces(log.thrust, vehicle), log.wrench], axis=1)
        self._times = log.times - self.start
        self._sampled = log.sampled
        self._matrix, self.thrusters = vehicle.thruster_matrix, vehicle.n_thrusters
        self.impulses: Impulses | None = None  # what samples leave open; None where every change is logged
        if log.sampled:
            self.impulses = open_impulses(self._times, forces[:, : vehicle.n_thrusters], self._matrix)

        self._mean = self._means(forces)
        self._mean_backward = self._means(np.minimum(forces[:, : vehicle.n_thrusters], 0.0))

    def _means(self, forces: Array) -> Array:
        """Return the mean over each step of the grid: of held values, or of samples with straight lines between."""
        spans = np.diff(self._times, append=self._times[-1])[:, None]
        slopes = np.zeros_like(forces)
        if self._sampled:
            slopes[:-1] = np.diff(forces, axis=0) / spans[:-1]
        pieces = forces * spans + 0.5 * slopes * spans**2
        edges = np.arange(self.steps + 1) * self.step
        at = np.clip(np.searchsorted(self._times, edges, side="right") - 1, 0, len(self._times) - 1)
        since = (edges - self._times[at])[:, None]
        impulse = (np.cumsum(pieces, axis=0) - pieces)[at] + forces[at] * since + 0.5 * slopes[at] * since**2
        means: Array = np.diff(impulse, axis=0) / self.step
        return means

    def actuation(self, lag: float, scales: Array, losses: Array | None = None) -> Actuation:
        """Return the wrench of each step.

        Parameters
        ----------
        lag : float
            Time constant of all thrusters [s].
        scales : ndarray, shape (thrusters,)
            Factor of each thruster's force.
        losses : ndarray, shape (thrusters,), optional
            Part of its force that each thruster lacks backward; default: none.

        Returns
        -------
        Actuation
            With its derivatives.
        """
        n = self._matrix.shape[1]
        lost = np.zeros(n) if losses is None else losses
        force, by_lag = _lagged(self._mean[:, :n] - lost * self._mean_backward, lag, self.step)
        backward, _ = _lagged(self._mean_backward, lag, self.step)
        matrix = (self._matrix * scales).T
        wrench = force @ matrix
        wrench[:, 0] += self._mean[:, n:]
        by_scale = self._matrix.T[:, None, None, :] * np.moveaxis(force, 2, 0)[..., None]
        by_loss = -matrix[:, None, None, :] * np.moveaxis(backward, 2, 0)[..., None]
        return Actuation(wrench, by_lag @ matrix, by_scale, by_loss, lag)


def steady_forces(commands: Array, vehicle: Vehicle) -> Array:
    """Return the steady-state forces of commands, with the plant's limits and curve.

    Parameters
    ----------
    commands : ndarray, shape (rows, thrusters)
        [N].
    vehicle : Vehicle
        Limits, dead bands and curves.

    Returns
    -------
    ndarray, shape (rows, thrusters)
        [N].
    """
    limited = np.clip(commands, vehicle.thrust_min, vehicle.thrust_max)
    dead, curve = vehicle.thrust_dead_band, vehicle.thrust_curve
    limit = np.where(limited < 0.0, vehicle.thrust_min, vehicle.thrust_max)
    part = np.divide(limited, limit, out=np.zeros_like(limited), where=limit != 0.0)
    live = np.maximum((part - dead) / np.where(dead < 1.0, 1.0 - dead, 1.0), 0.0)
    result: Array = np.where((dead == 0.0) & (curve == 0.0), limited, limit * live * (1.0 - curve + curve * live))
    return result


def _lagged(forces: Array, lag: float, step: float) -> tuple[Array, Array]:
    """Return forces behind a lag, shape (steps, 2, n): mean and change of each step; and the same by the lag.

    Over a step they head for one value. Before the first they are taken to be at rest with it.
    """
    zero = np.zeros((1, forces.shape[1]))
    if lag < _LEAST_LAG:
        behind = np.diff(forces, axis=0, prepend=forces[:1]) / step
        return np.stack([forces, 0.0 * forces], axis=1), np.stack([-behind, 0.0 * behind], axis=1)
    pole = math.exp(-step / lag)
    pole_by_lag = pole * step / lag**2
    share = lag / step * (1.0 - pole)  # of the gap at the step's begin, in its mean
    share_by_lag = (1.0 - pole) / step - lag / step * pole_by_lag
    ends, _ = lfilter([1.0 - pole], [1.0, -pole], forces, axis=0, zi=forces[:1] * pole)
    begins = np.concatenate([forces[:1], ends[:-1]])
    gaps = begins - forces
    ends_by_lag, _ = lfilter([1.0], [1.0, -pole], gaps * pole_by_lag, axis=0, zi=zero)
    begins_by_lag = np.concatenate([zero, ends_by_lag[:-1]])
    means_by_lag = gaps * share_by_lag + begins_by_lag * share
    return (
        np.stack([forces + gaps * share, ends - begins], axis=1),
        np.stack([means_by_lag, ends_by_lag - begins_by_lag], axis=1),
    )
