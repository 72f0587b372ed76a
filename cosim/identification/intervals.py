"""How sure the numbers are: intervals that do not trust the model, and what rests on what was known before."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from cosim.identification.parameters import Parameter
from cosim.identification.residuals import Reduced
from cosim.identification.windows import Window

Array = NDArray[np.float64]

DISAGREES = 1.2  # chi2 by degrees of freedom, above which the model is called wrong
RESTS = 0.5  # of the prior's deviation: above it, a number rests on its prior
_BLOCK = 5.0  # s, of residuals that stay together in the jackknife
_LONG_BLOCK = 20.0  # s, of windows that stay together where the model is wrong: what it lacks may last for seconds
_FEWEST_RUNS = 8  # from which on whole runs are left out instead
_COVERED = 0.95


@dataclass(frozen=True)
class Intervals:
    """Uncertainty of p numbers."""

    deviations: Array  # (p,) standard, as stated: of the jackknife, or nominal where that is greater
    nominal: Array  # (p,) as white noise of the sensors alone would have it
    covariance: Array  # (p, p) with `deviations`, and the correlation of the fit
    factor: float  # of a deviation: half of the 95 % interval
    clusters: str  # what the jackknife leaves out
    chi2: float  # by degrees of freedom
    prior_part: Array  # (p,) nominal deviation, in deviations of the prior

    @property
    def correlation(self) -> Array:
        """Correlation of the numbers, shape (p, p)."""
        size = np.sqrt(np.diag(self.covariance))
        result: Array = self.covariance / np.outer(size, size)
        return result


def estimate_intervals(
    parameters: Sequence[Parameter], values: Array, reduced: Sequence[Reduced], windows: Sequence[Window]
) -> Intervals:
    """Return the uncertainty of a fit.

    Parameters
    ----------
    parameters : sequence of Parameter
        What is free, with its prior.
    values : ndarray, shape (p,)
        As fitted.
    reduced : sequence of Reduced
        Of each window, at those values.
    windows : sequence of Window
        The windows.

    Returns
    -------
    Intervals
        By a jackknife over pieces of 5 s, of 20 s where the model is wrong, or over runs where there are eight or more:
        each left out in turn, in one Gauss-Newton step (Bell and McCaffrey 2002, CR3). Nominal ones hold for white
        noise and a right model alone.
    """
    prior = np.array([1.0 / p.deviation**2 for p in parameters])
    information = np.diag(prior) + sum(r.jacobian.T @ r.jacobian for r in reduced)
    rows = sum(len(r.residual) for r in reduced)
    starts = 10 * len(windows)
    chi2 = float(sum(r.residual @ r.residual for r in reduced)) / max(1, rows - len(values) - starts)
    inverse = np.linalg.inv(information)
    nominal = np.sqrt(np.diag(inverse))

    pieces, clusters = _pieces(reduced, windows, chi2 > DISAGREES)
    moved = np.stack([
        np.linalg.solve(information - jacobian.T @ jacobian, jacobian.T @ residual) for jacobian, residual in pieces
    ])  # fmt: skip
    n = len(pieces)
    jackknife = np.sqrt((n - 1.0) / n * np.sum(np.square(moved - moved.mean(axis=0)), axis=0)) if n > 1 else nominal
    deviations = np.maximum(jackknife, nominal)
    scale = deviations / nominal
    covariance: Any = inverse * np.outer(scale, scale)
    return Intervals(
        deviations=deviations, nominal=nominal, covariance=covariance,
        factor=float(student.ppf(0.5 + _COVERED / 2.0, max(1, n - 1))), clusters=clusters, chi2=chi2,
        prior_part=nominal * np.sqrt(prior),
    )  # fmt: skip


def _pieces(
    reduced: Sequence[Reduced], windows: Sequence[Window], wrong: bool
) -> tuple[list[tuple[Array, Array]], str]:
    """Return rows that stay together, and what they are."""
    runs = len({window.run for window in windows})
    if runs >= _FEWEST_RUNS or wrong:
        whole = runs >= _FEWEST_RUNS
        together: dict[tuple[int, int], list[Reduced]] = {}
        for r, window in zip(reduced, windows, strict=True):
            together.setdefault((window.run, 0 if whole else int(window.begin / _LONG_BLOCK)), []).append(r)
        joined = [
            (np.concatenate([r.jacobian for r in own]), np.concatenate([r.residual for r in own]))
            for own in together.values()
        ]
        if whole or len(joined) > 1:
            return joined, f"each of {runs} runs" if whole else f"each of {len(joined)} pieces of {_LONG_BLOCK:g} s"
    found = []
    for r in reduced:
        block = (r.times / _BLOCK).astype(int)
        found += [(r.jacobian[block == k], r.residual[block == k]) for k in np.unique(block)]
    return found, f"each of {len(found)} pieces of {_BLOCK:g} s"
