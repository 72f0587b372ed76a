"""Uncertainty of the numbers: jackknife intervals, which hold for a wrong model too, and the weight of the priors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import t as student

from cosim.identification.parameters import Parameter
from cosim.identification.residuals import Reduced
from cosim.identification.windows import Window
from cosim.simulation.signals import Array

DISAGREES = 1.2  # chi2 per degree of freedom, above which the model is called wrong
MAX_PRIOR_FRACTION = 0.5  # ratio of nominal to prior deviation, above which a number rests on its prior
_BLOCK = 5.0  # s, length of the pieces that the jackknife leaves out
_LONG_BLOCK = 20.0  # s, their length if neighboring windows are correlated: a model error may last for seconds
_MIN_RUNS = 8  # number of runs from which on the jackknife leaves out whole runs
_COVERAGE = 0.95  # coverage of the intervals
NORMAL = 1.96  # standard deviations, half width of a 95 % interval of a normal distribution


@dataclass(frozen=True)
class Intervals:
    """Uncertainty of p numbers."""

    half: Array  # (p,) half widths of the 95 % intervals: of the jackknife, or nominal ones where they are greater
    nominal: Array  # (p,) standard deviations for white noise of the sensors and a right model
    covariance: Array  # (p, p) covariance of a normal distribution with these intervals and the fit's correlation
    clusters: str  # description of the pieces that the jackknife leaves out
    chi2: float  # chi2 per degree of freedom
    prior_fraction: Array  # (p,) ratios of nominal to prior deviation

    @property
    def correlation(self) -> Array:
        """Correlation of the numbers, shape (p, p)."""
        size = np.sqrt(np.diag(self.covariance))
        result: Array = self.covariance / np.outer(size, size)
        return result


def estimate_intervals(
    parameters: Sequence[Parameter], values: Array, reduced: Sequence[Reduced], windows: Sequence[Window],
    eliminated: int, correlated: bool,
) -> Intervals:  # fmt: skip
    """Return the uncertainty of a fit; values (p,)."""
    prior = np.array([1.0 / p.deviation**2 for p in parameters])
    information = np.diag(prior) + sum(r.jacobian.T @ r.jacobian for r in reduced)
    rows = sum(len(r.residual) for r in reduced)
    starts = eliminated * len(windows)
    chi2 = float(sum(r.residual @ r.residual for r in reduced)) / max(1, rows - len(values) - starts)
    inverse: Any = np.linalg.inv(information)
    nominal = np.sqrt(np.diag(inverse))

    runs = len({window.run for window in windows})
    are_correlated = correlated or chi2 > DISAGREES
    pieces, clusters = _pieces(reduced, windows, are_correlated)
    half = NORMAL * nominal
    if len(pieces) > 1:
        jackknife, freedom = _jackknife(information, inverse, pieces)
        if not are_correlated:  # residuals agree with the noise: degrees of freedom by the number of pieces suffice
            freedom = np.full_like(freedom, len(pieces) - 1.0)
        wide = np.maximum(half, jackknife * student.ppf(0.5 + _COVERAGE / 2.0, freedom))
        # a number of one run is not determined without it: the noise tells its interval, as large as the residuals are
        of_run = np.array([p.run is not None for p in parameters])
        half = np.where(of_run & (runs >= _MIN_RUNS), half * np.sqrt(max(1.0, chi2)), wide)
    scale = half / (NORMAL * nominal)
    covariance: Any = inverse * np.outer(scale, scale)
    return Intervals(
        half=half, nominal=nominal, covariance=covariance, clusters=clusters, chi2=chi2,
        prior_fraction=nominal * np.sqrt(prior),
    )  # fmt: skip


def _jackknife(information: Array, inverse: Array, pieces: Sequence[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Return the standard deviations of the numbers by leaving out each piece, (p,), and degrees of freedom, (p,)."""
    # A number that few pieces determine has few degrees of freedom. They are those of the chi² distribution that has
    # the mean and the variance of the squared deviation for white noise (Satterthwaite 1946).
    own = [jacobian.T @ jacobian for jacobian, _ in pieces]
    left_out = [np.linalg.inv(information - part) for part in own]  # (p, p) each, symmetric
    scores = [jacobian.T @ residual for jacobian, residual in pieces]
    shifts = np.stack([inv @ score for inv, score in zip(left_out, scores, strict=True)])
    n = len(pieces)
    deviations: Array = np.sqrt((n - 1.0) / n * np.sum(np.square(shifts), axis=0))
    reached = np.stack([part @ inv for part, inv in zip(own, left_out, strict=True)])  # (n, p, p)
    across = -np.einsum("gkj,kl,hlj->jgh", reached, inverse, reached, optimize=True)  # covariances of moves of pieces
    alone = np.einsum("gkj,gkj->gj", np.stack(left_out), reached)
    across[:, range(n), range(n)] += alone.T
    trace = np.trace(across, axis1=1, axis2=2)
    squares = np.sum(np.square(across), axis=(1, 2))
    freedom: Array = np.full(len(trace), n - 1.0)  # default, for numbers that no piece moves
    np.divide(np.square(trace), squares, out=freedom, where=squares > 0.0)
    return deviations, np.maximum(1.0, freedom)


def _pieces(
    reduced: Sequence[Reduced], windows: Sequence[Window], are_correlated: bool
) -> tuple[list[tuple[Array, Array]], str]:
    """Return jacobian and residual of each piece that the jackknife leaves out, and a description of the pieces."""
    runs = len({window.run for window in windows})
    if runs >= _MIN_RUNS or are_correlated:
        by_run = runs >= _MIN_RUNS
        groups: dict[tuple[int, int], list[Reduced]] = {}
        for r, window in zip(reduced, windows, strict=True):
            groups.setdefault((window.run, 0 if by_run else int(window.begin / _LONG_BLOCK)), []).append(r)
        pieces = [
            (np.concatenate([r.jacobian for r in group]), np.concatenate([r.residual for r in group]))
            for group in groups.values()
        ]
        if by_run:
            return pieces, f"each of {runs} runs"
        if len(pieces) > 1:
            return pieces, f"each of {len(pieces)} pieces of {_LONG_BLOCK:g} s"
    blocks = [(r.times / _BLOCK).astype(int) for r in reduced]
    pieces = [
        (r.jacobian[block == k], r.residual[block == k])
        for r, block in zip(reduced, blocks, strict=True) for k in np.unique(block)
    ]  # fmt: skip
    return pieces, f"each of {len(pieces)} pieces of {_BLOCK:g} s"
