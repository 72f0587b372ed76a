"""The wrench that commands put on the body, step by step, and how it depends on lag and thrust."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.signal import lfilter

from cosim.errors import IdentificationError
from cosim.identification.command_errors import BIN, Impulses, open_impulses
from cosim.identification.log import Log
from cosim.simulation.signals import Array
from plant_fmu.vehicle import Vehicle

_MIN_LAG = 1e-4  # s; a shorter one is none
_TAIL = 3.0  # time constants, after which an impulse has passed the lag
_DIPOLE = 4.0  # forces of -4 and 4 in the halves of a period have first moment 1 about its middle, per period squared

# numbers that say how commands change between two samples, in the order of `Actuation.by_changes`
CHANGES = (*(f"{what} of {axis}" for what in ("lateness", "spread") for axis in "XYZKMN"), "smoothness")


@dataclass(frozen=True)
class Actuation:
    """Wrenches that are linear over each step of a grid: mean and change from start to end, and their derivatives."""

    wrench: Array  # (steps, 2, 6) N, N m
    by_lag: Array  # (steps, 2, 6) N/s, N m/s, by the time constant of all thrusters
    by_scale: Array  # (thrusters, steps, 2, 6) N, N m, by a factor of each thruster
    by_loss: Array  # (thrusters, steps, 2, 6) N, N m, by the part that each thruster lacks backward
    by_changes: Array  # (c, steps, 2, 6) N, N m, by each of `CHANGES`; c is 0 where every change is logged
    lag: float  # s, time constant of all thrusters


class CommandedForces:
    """The forces that the commands of a run ask for, after limits, dead band and curve; step [s]."""

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
        self._mean_changes: list[Array] = []  # of lateness, spread and smoothness, for the whole forces
        if log.sampled:
            changes = np.diff(forces[:, : vehicle.n_thrusters], axis=0, append=forces[-1:, : vehicle.n_thrusters])
            middles = self._times + 0.5 * np.diff(self._times, append=self._times[-1])
            halves = np.column_stack([self._times, middles]).ravel()
            signs = np.tile([[-1.0], [1.0]], (len(changes), 1))
            moments = (-np.repeat(changes, 2, axis=0), _DIPOLE * np.repeat(changes, 2, axis=0) * signs)
            bends = np.diff(changes, axis=0, prepend=changes[:1])
            self._mean_changes = [self._means(x, halves) for x in moments]
            self._mean_changes.append(self._means(bends / 12.0, np.append(self._times[:1], middles[:-1])))

    def _means(self, forces: Array, held_from: Array | None = None) -> Array:
        """Return the mean over each step of the grid: of held values, or of samples with straight lines between."""
        times = self._times if held_from is None else held_from
        spans = np.diff(times, append=times[-1])[:, None]
        slopes = np.zeros_like(forces)
        if self._sampled and held_from is None:
            slopes[:-1] = np.diff(forces, axis=0) / spans[:-1]
        pieces = forces * spans + 0.5 * slopes * spans**2
        edges = np.arange(self.steps + 1) * self.step
        at = np.clip(np.searchsorted(times, edges, side="right") - 1, 0, len(times) - 1)
        since = (edges - times[at])[:, None]
        impulse = (np.cumsum(pieces, axis=0) - pieces)[at] + forces[at] * since + 0.5 * slopes[at] * since**2
        means: Array = np.diff(impulse, axis=0) / self.step
        return means

    def actuation(
        self, lag: float, scales: Array, losses: Array | None = None, changes: Array | None = None
    ) -> Actuation:
        """Return the wrench of each step; lag [s], scales (thrusters,), losses (thrusters,), changes (13,)."""
        n = self._matrix.shape[1]
        lost = np.zeros(n) if losses is None else losses
        force, by_lag = _lagged(self._mean[:, :n] - lost * self._mean_backward, lag, self.step)
        backward, _ = _lagged(self._mean_backward, lag, self.step)
        matrix = (self._matrix * scales).T
        wrench = force @ matrix
        by_changes = np.zeros((len(CHANGES) if self._sampled else 0, *wrench.shape))
        if self._sampled:
            from_rest = (np.concatenate([np.zeros_like(mean[:1]), mean]) for mean in self._mean_changes)
            late, spread, by_changes[12] = (_lagged(mean, lag, self.step)[0][1:] @ matrix for mean in from_rest)
            by_changes[range(6), ..., range(6)] = np.moveaxis(late, 2, 0)
            by_changes[range(6, 12), ..., range(6)] = np.moveaxis(spread, 2, 0)
            if changes is not None:
                wrench += np.einsum("i,iksj->ksj", changes, by_changes)
        wrench[:, 0] += self._mean[:, n:]
        by_scale = self._matrix.T[:, None, None, :] * np.moveaxis(force, 2, 0)[..., None]
        by_loss = -matrix[:, None, None, :] * np.moveaxis(backward, 2, 0)[..., None]
        return Actuation(wrench, by_lag @ matrix, by_scale, by_loss, by_changes, lag)


def steady_forces(commands: Array, vehicle: Vehicle) -> Array:
    """Return the steady-state forces [N] of commands [N], with the plant's limits and curve."""
    limited = np.clip(commands, vehicle.thrust_min, vehicle.thrust_max)
    dead, curve = vehicle.thrust_dead_band, vehicle.thrust_curve
    limit = np.where(limited < 0.0, vehicle.thrust_min, vehicle.thrust_max)
    part = np.divide(limited, limit, out=np.zeros_like(limited), where=limit != 0.0)
    live = np.maximum((part - dead) / np.where(dead < 1.0, 1.0 - dead, 1.0), 0.0)
    result: Array = np.where((dead == 0.0) & (curve == 0.0), limited, limit * live * (1.0 - curve + curve * live))
    return result


def error_wrenches(impulses: Impulses, lag: float, step: float, begin: float, steps: int) -> Array:
    """Return the wrench of each error behind the lag, over each step of a window, shape (errors, steps, 2, 6)."""
    # Units of arguments and result: lag [s]; step [s]; begin [s]; result [N, N m]
    before = int(np.ceil((_TAIL * lag + 2.0 * BIN) / step))  # steps before the window
    grid: Any = begin + step * np.arange(-before, steps + 1)
    used = (impulses.ends > begin - _TAIL * lag - BIN) & (impulses.begins < grid[-1])
    shares, roots = [np.zeros((len(grid) - 1, 0))], [np.zeros((0, 6, 6))]
    for b, e, root, shifted in zip(
        *(x[used] for x in (impulses.begins, impulses.ends, impulses.roots, impulses.shifted)), strict=True
    ):
        first, second = (_overlaps(grid, x, x + 0.5 * (e - b)) for x in (b, 0.5 * (b + e)))
        shares.append(np.column_stack([0.5 * (first + second), shifted * (first - second)]))
        roots.append(np.stack([root, root]))
    course = _lagged(np.concatenate(shares, axis=1) / step, lag, step)[0][before:]
    result: Array = np.einsum("ksc,cij->cjksi", course, np.concatenate(roots)).reshape(-1, steps, 2, 6)
    return result


def _overlaps(grid: Any, begin: float, end: float) -> Array:
    """Return the fraction of a span that overlaps each step of a grid."""
    inside = np.minimum(grid[1:], end) - np.maximum(grid[:-1], begin)
    result: Array = np.clip(inside, 0.0, None) / max(end - begin, 1e-9)
    return result


def _lagged(forces: Array, lag: float, step: float) -> tuple[Array, Array]:
    """Return forces behind a lag as they are over each step of a grid, and the same by the lag; forces [N], lag [s]."""
    # Units of arguments and result: step [s]; result [N]
    zero = np.zeros((1, forces.shape[1]))
    if lag < _MIN_LAG:
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
