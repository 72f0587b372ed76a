"""Forces behind a lag, which are linear over each step of a grid."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

Array = NDArray[np.float64]

_LEAST_LAG = 1e-4  # s; a shorter one is none


def lagged(forces: Array, lag: float, step: float) -> tuple[Array, Array]:
    """Return forces behind a lag as they are over each step of a grid, and the same by the lag.

    Parameters
    ----------
    forces : ndarray, shape (steps, n)
        To which they head over each step [N]. Before the first step they are at rest with it.
    lag : float
        Time constant [s].
    step : float
        Of the grid [s].

    Returns
    -------
    forces : ndarray, shape (steps, 2, n)
        Mean of each step, and change from its begin to its end [N].
    by_lag : ndarray, shape (steps, 2, n)
        Their derivatives [N/s].
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
