"""Statistics for pages and summaries: rates with intervals, quantiles, bins, effects, and paired differences."""

# `scipy.stats` is imported in the functions, since workers import this module without using it, and importing takes
# long.

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cosim.simulation.signals import Array

Facts = NDArray[np.bool_]

CONFIDENCE = 0.95  # confidence level of all intervals
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
CHANCE = 0.01  # significance level of effects and rank correlations
_BINS = 6  # maximum number of bins; fewer distinct values have one bin each
_MIN_ROWS = 16  # minimum number of rows for an effect: two bins of eight
_RESAMPLES = 2000  # number of resamples of a bootstrap
_ROUNDING = 1e-14  # relative range within which an outcome counts as constant


def rate(happened: Facts) -> dict[str, Any]:
    """Return count and share of rows in which an event happened, and the 95 % interval of the share by Wilson."""
    n, k = len(happened), int(happened.sum())
    if not n:
        return {"rows": 0, "share": None, "low": None, "high": None}
    from scipy.stats import binomtest

    interval = binomtest(k, n).proportion_ci(CONFIDENCE, method="wilson")
    return {"rows": k, "share": k / n, "low": float(interval.low), "high": float(interval.high)}


def quantiles(values: Array) -> dict[str, float | None]:
    """Return quantiles of the finite numbers; values (n,)."""
    values = values[np.isfinite(values)]
    numbers = np.quantile(values, QUANTILES).tolist() if values.size else [None] * len(QUANTILES)
    return dict(zip(map(str, QUANTILES), numbers, strict=True))


class Bin(NamedTuple):
    """Rows with neighboring values of a key."""

    median: float  # of the values
    rows: Facts  # (n,) mask of the rows in the bin


def bins(values: Array) -> Iterator[Bin]:
    """Yield the bins of a key: one for each value if there are few, otherwise bins with equal numbers of rows."""
    indices = _bin_indices(values, _BINS)
    for i in np.unique(indices):
        yield Bin(float(np.median(values[indices == i])), indices == i)


def _bin_indices(values: Array, max_bins: int) -> NDArray[np.int64]:
    """Return the index of the bin of each value, from 0, with at most `max_bins` bins."""
    distinct = np.unique(values)
    if len(distinct) <= max_bins:
        return np.searchsorted(distinct, values)
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, max_bins + 1)[1:-1]))
    return np.searchsorted(edges, values, side="left")


def effect(values: Array, outcome: Array) -> dict[str, float] | None:
    """Estimate the share of an outcome's variance that a key alone explains: its first-order Sobol' index."""
    # It measures a dependence of any form, also a non-monotonic one, which a correlation does not show. The outcome is
    # fitted by a line in each of several bins of the key, or by its mean at each value of a key with few values. The
    # estimate is the share that the fit explains, corrected for chance (adjusted R²; for means Kelley's ε²).
    n = len(values)
    if n < _MIN_ROWS or np.ptp(values) == 0.0 or np.ptp(outcome) <= _ROUNDING * np.abs(outcome).max():
        return None
    few = len(np.unique(values)) <= math.isqrt(n)
    indices = _bin_indices(values, math.isqrt(n) // (1 if few else 2))
    y = outcome - outcome.mean()
    rows = np.maximum(np.bincount(indices), 1)
    explained, terms = np.sum(np.bincount(indices, y) ** 2 / rows), np.count_nonzero(np.bincount(indices))
    if not few:
        x = values - (np.bincount(indices, values) / rows)[indices]
        spread = np.bincount(indices, x * x)
        sloped = spread > 0.0
        explained += np.sum(np.bincount(indices, x * y)[sloped] ** 2 / spread[sloped])
        terms += np.count_nonzero(sloped)
    from scipy.stats import beta

    chance = beta.ppf(1.0 - CHANCE, (terms - 1) / 2.0, (n - terms) / 2.0)
    share, floor = (1.0 - (1.0 - r_squared) * (n - 1) / (n - terms) for r_squared in (explained / (y @ y), chance))
    return {"share": float(share), "floor": float(floor)}


def count_pairs(one: Facts, other: Facts) -> dict[str, Any]:
    """Count the scenes that both laws, only one, or none of them completes; one, other (n,)."""
    from scipy.stats import binomtest

    only_one, only_other = int((one & ~other).sum()), int((other & ~one).sum())
    uneven = only_one + only_other
    return {
        "both": int((one & other).sum()),
        "only_one": only_one,
        "only_other": only_other,
        "neither": int((~one & ~other).sum()),
        "p": float(binomtest(only_one, uneven).pvalue) if uneven else None,
    }


def median_difference(differences: Array) -> dict[str, Any]:
    """Return the median of paired differences and its distribution-free 95 % interval; differences (n,)."""
    n = len(differences)
    if not n:
        return {"pairs": 0, "median": None, "low": None, "high": None}
    from scipy.stats import quantile_test

    interval = quantile_test(differences, q=0.0, p=0.5).confidence_interval(CONFIDENCE)
    low, high = _finite(interval.low, interval.high)
    return {"pairs": n, "median": float(np.median(differences)), "low": low, "high": high}


def mean_ratio(one: Array, other: Array) -> dict[str, Any]:
    """Return the means of two laws over the same rows, and their ratio with its 95 % interval; one, other (n,)."""
    finite = np.isfinite(one) & np.isfinite(other)
    one, other, n = one[finite], other[finite], int(finite.sum())
    if not n:
        return {"pairs": 0, "one": None, "other": None, "ratio": None, "low": None, "high": None}
    means: dict[str, Any] = {"pairs": n, "one": float(one.mean()), "other": float(other.mean())}
    if not means["other"] > 0.0:
        return means | {"ratio": None, "low": None, "high": None}
    rng, ratios = np.random.default_rng(0), np.empty(_RESAMPLES)
    for i in range(_RESAMPLES):
        rows = rng.integers(n, size=n)
        divisor = other[rows].sum()
        ratios[i] = one[rows].sum() / divisor if divisor > 0.0 else np.inf
    tail = 0.5 * (1.0 - CONFIDENCE)
    low, high = _finite(*np.quantile(ratios, [tail, 1.0 - tail], method="nearest"))
    return means | {"ratio": means["one"] / means["other"], "low": low, "high": high}


def _finite(*numbers: float) -> list[float | None]:
    return [float(x) if np.isfinite(x) else None for x in numbers]
