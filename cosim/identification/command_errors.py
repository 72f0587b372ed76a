"""Uncertainty of sampled commands: impulses between samples, as process noise that weights the residuals."""

# A log that samples servo outputs does not say when within a period a thrust changed. The error of the impulse is of
# mean zero, independent between periods, and as large as the change times the period by the square root of 12, where a
# step may be at any time. It moves the vehicle through its lag and its equations, so that residuals of neighboring
# samples are correlated: they are weighed by the inverse root of that covariance (generalized least squares).

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cosim.simulation.signals import Array

BIN = 0.05  # s; errors of shorter periods are taken together
_SHIFTED = 0.25, 0.5  # part of an error that goes from the first half to the second: of one period, of several
_AROUND = 0.5  # s, to either side, over which squared changes are averaged
_SIZES = np.concatenate([[0.0], np.geomspace(0.02, 10.0, 80)])  # of the errors, in those of steps at any time
_UPDATES, _EVERY = 3, 4  # updates of the noise of each topic; every fourth window is used for them
_MIN_FACTOR = 0.05  # least part of the noise from differences of samples that a topic has
_MIN_VARIANCE = 1e-2  # of the noise's variance: smaller ones hardly change a weight


@dataclass(frozen=True)
class Impulses:
    """Independent errors of the impulse that sampled commands leave open."""

    begins: Array  # (bins,) s, since the first command
    ends: Array  # (bins,) s
    roots: Array  # (bins, 6, 6) N s, N m s: a root of each covariance
    shifted: Array  # (bins,) part of each that goes from the first half to the second, independent of the whole


@dataclass(frozen=True)
class Whitener:
    """Inverse root of a covariance: that of the noise, 1, with that of a few directions beside."""

    directions: Array  # (rows, n) orthonormal
    variances: Array  # (n,) beside that of the noise

    def __call__(self, values: Array) -> Array:
        """Return values, shape (rows,) or (rows, m), multiplied by the inverse root."""
        less = 1.0 - 1.0 / np.sqrt(1.0 + self.variances)
        result: Array = values - self.directions @ (
            less[:, None] * (self.directions.T @ values.reshape(len(values), -1))
        ).reshape(len(less), *values.shape[1:])
        return result


def open_impulses(times: Array, forces: Array, matrix: Array) -> Impulses:
    """Return the errors of the impulse between samples of forces; times [s], forces [N, N m]."""
    periods = np.diff(times)
    changes = np.diff(forces @ matrix.T, axis=0)
    squares = changes[:, :, None] * changes[:, None, :]
    near = 0.5 * (_mean_about(squares, 3) + _mean_about(squares, round(2.0 * _AROUND / float(np.median(periods)))))
    covariances = near * np.square(periods)[:, None, None] / 12.0
    group = np.floor((times[:-1] - times[0]) / BIN + 1e-6).astype(int)
    starts = np.flatnonzero(np.diff(group, prepend=-1))
    sizes, axes = np.linalg.eigh(np.add.reduceat(covariances, starts, axis=0))
    return Impulses(
        times[starts], times[np.append(starts[1:], len(times) - 1)],
        axes * np.sqrt(np.maximum(sizes, 0.0))[:, None, :],
        np.where(np.diff(np.append(starts, len(group))) > 1, _SHIFTED[1], _SHIFTED[0]),
    )  # fmt: skip


def _mean_about(values: Array, count: int) -> Array:
    """Return the mean of values about each, of `count` as far as there are."""
    sums = np.cumsum(np.concatenate([np.zeros_like(values[:1]), values]), axis=0)
    first = np.clip(np.arange(len(values)) - count // 2, 0, None)
    last = np.minimum(np.arange(len(values)) + count // 2 + 1, len(values))
    result: Array = (sums[last] - sums[first]) / (last - first)[:, None, None]
    return result


def whitener(by_impulse: Array, size: float) -> Whitener:
    """Return the inverse root of the covariance of residuals under impulses of a size; by_impulse (rows, n)."""
    variances, axes = np.linalg.eigh(size**2 * (by_impulse.T @ by_impulse))
    large = variances > _MIN_VARIANCE
    directions = size * (by_impulse @ axes[:, large]) / np.sqrt(variances[large])
    return Whitener(directions, variances[large])


def most_likely_size(residuals: Sequence[Array], by_impulses: Sequence[Array]) -> float:
    """Return the factor of all impulses that explains residuals best; both without what the starts explain."""
    lost = np.zeros(len(_SIZES))
    for residual, by in zip(residuals, by_impulses, strict=True):
        variances, axes = np.linalg.eigh(by.T @ by)
        large = variances > _MIN_VARIANCE
        squares = np.square((by @ axes[:, large]).T @ residual) / variances[large]
        total = 1.0 + np.square(_SIZES)[:, None] * variances[large]
        lost += np.sum(np.log(total) + squares / total, axis=1)
    return float(_SIZES[int(np.argmin(lost))])


def noise_parts(
    residuals: Sequence[Array], whiteners: Sequence[Whitener], topics: Sequence[NDArray[np.str_]]
) -> dict[str, float]:
    """Return the factor of each topic's noise, in one step towards the greatest likelihood (Harville 1977)."""
    squares, freedom = dict[str, float](), dict[str, float]()
    for residual, white, own in zip(residuals, whiteners, topics, strict=True):
        share = white.variances / (1.0 + white.variances)
        left = residual - white.directions @ (share * (white.directions.T @ residual))
        free = 1.0 - np.square(white.directions) @ share
        for name in np.unique(own):
            squares[name] = squares.get(name, 0.0) + float(np.sum(np.square(left[own == name])))
            freedom[name] = freedom.get(name, 0.0) + float(np.sum(free[own == name]))
    return {str(name): float(np.sqrt(squares[name] / max(freedom[name], 1e-9))) for name in squares}


def most_likely_errors(
    residuals: Sequence[Array], by_impulses: Sequence[Array], topics: Sequence[NDArray[np.str_]],
    known: Mapping[str, float],
) -> tuple[float, dict[str, float]]:  # fmt: skip
    """Return the factor of all impulses and the noise of each topic that explain residuals best."""
    parts = {str(name): known.get(str(name), 1.0) for labels in topics for name in np.unique(labels)}
    residuals, by_impulses = [x.copy() for x in residuals], [x.copy() for x in by_impulses]
    for _ in range(_UPDATES):
        size = most_likely_size(residuals[::_EVERY], by_impulses[::_EVERY])
        whiteners = [whitener(by, size) for by in by_impulses[::_EVERY]]
        for name, part in noise_parts(residuals[::_EVERY], whiteners, topics[::_EVERY]).items():
            new = float(np.clip(parts[name] * part, _MIN_FACTOR, 1.0))
            for residual, by, labels in zip(residuals, by_impulses, topics, strict=True):
                residual[labels == name] *= parts[name] / new
                by[labels == name] *= parts[name] / new
            parts[name] = new
    return most_likely_size(residuals, by_impulses), parts
