"""Numbers that pages and summaries have in common: rates with intervals, quantiles, bins, effects, paired differences.

SciPy's statistics take as long to import as all else that a worker needs, and no worker needs them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cosim.simulation.signals import Array

Facts = NDArray[np.bool_]

CONFIDENCE = 0.95
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
CHANCE = 0.01  # how often chance alone makes an effect or a rank correlation that is told
_BINS = 6  # at the most; fewer distinct values have one each
_LEAST_ROWS = 16  # of which an effect is told: two bins of eight
_RESAMPLES = 2000  # of a bootstrap
_ROUNDING = 1e-14  # of a number, within which an outcome is constant


def rate(happened: Facts) -> dict[str, Any]:
    """Return how many, which share of all, and the 95 % interval of it by Wilson.

    Parameters
    ----------
    happened : ndarray of bool, shape (n,)
        Of each row.

    Returns
    -------
    dict
        ``rows`` that it happened in, ``share``, and ``low`` and ``high`` of the interval; None of no rows.
    """
    n, k = len(happened), int(happened.sum())
    if not n:
        return {"rows": 0, "share": None, "low": None, "high": None}
    from scipy.stats import binomtest

    interval = binomtest(k, n).proportion_ci(CONFIDENCE, method="wilson")
    return {"rows": k, "share": k / n, "low": float(interval.low), "high": float(interval.high)}


def quantiles(values: Array) -> dict[str, float | None]:
    """Return quantiles of numbers that there are and that are finite.

    Parameters
    ----------
    values : ndarray, shape (n,)
        NaN where there is none.

    Returns
    -------
    dict of str to float or None
        By the quantile, such as ``"0.5"``.
    """
    values = values[np.isfinite(values)]
    found = np.quantile(values, QUANTILES) if values.size else [None] * len(QUANTILES)
    return {str(q): None if x is None else float(x) for q, x in zip(QUANTILES, found, strict=True)}


class Bin(NamedTuple):
    """Rows whose values are near to each other."""

    low: float  # least of the values
    high: float  # greatest
    middle: float  # median
    rows: Facts  # (n,) which


def bins(values: Array) -> Iterator[Bin]:
    """Yield the bins of a key: one for each value where there are few, otherwise some with equally many rows.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Finite.

    Yields
    ------
    Bin
        From low to high; none is empty.
    """
    of = _bin_numbers(values, _BINS)
    for i in np.unique(of):
        rows = of == i
        own = values[rows]
        yield Bin(float(own.min()), float(own.max()), float(np.median(own)), rows)


def _bin_numbers(values: Array, most: int) -> NDArray[np.int64]:
    """Return the bin of each value, counted from 0, of so many bins at the most."""
    distinct = np.unique(values)
    if len(distinct) <= most:
        return np.searchsorted(distinct, values)
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, most + 1)[1:-1]))
    return np.searchsorted(edges, values, side="left")


def effect(values: Array, outcome: Array) -> dict[str, float] | None:
    """Estimate the share of an outcome's variance that goes with a key alone: its first-order Sobol' index.

    It sees a dependence of any form, also one that goes up and down again, of which no correlation tells. The outcome
    is fitted by a line in each of some bins of the key, or by its mean at each value where the key has few; the
    estimate is the share that the fit explains, less what chance adds to it (adjusted R²; of means: Kelley's ε²).

    Parameters
    ----------
    values : ndarray, shape (n,)
        Of the key, finite. Keys vary independently of each other.
    outcome : ndarray, shape (n,)
        Finite, or 0 and 1.

    Returns
    -------
    dict of str to float, or None
        ``share``, up to 1, and a little below 0 by chance; ``floor``, above which chance alone brings it in a
        hundredth of all cells (F test). None where key or outcome is constant, or rows are too few.
    """
    n = len(values)
    if n < _LEAST_ROWS or np.ptp(values) == 0.0 or np.ptp(outcome) <= _ROUNDING * np.abs(outcome).max():
        return None
    few = len(np.unique(values)) <= math.isqrt(n)
    of = _bin_numbers(values, math.isqrt(n) // (1 if few else 2))
    y = outcome - outcome.mean()
    rows = np.maximum(np.bincount(of), 1)
    explained, terms = np.sum(np.bincount(of, y) ** 2 / rows), np.count_nonzero(np.bincount(of))
    if not few:
        x = values - (np.bincount(of, values) / rows)[of]
        spread = np.bincount(of, x * x)
        sloped = spread > 0.0
        explained += np.sum(np.bincount(of, x * y)[sloped] ** 2 / spread[sloped])
        terms += np.count_nonzero(sloped)
    from scipy.stats import beta

    chance = beta.ppf(1.0 - CHANCE, (terms - 1) / 2.0, (n - terms) / 2.0)
    share, floor = (1.0 - (1.0 - of_all) * (n - 1) / (n - terms) for of_all in (explained / (y @ y), chance))
    return {"share": float(share), "floor": float(floor)}


def paired(one: Facts, other: Facts) -> dict[str, Any]:
    """Return where two laws come out otherwise on the same scenes.

    Parameters
    ----------
    one, other : ndarray of bool, shape (n,)
        Which scenes each completes.

    Returns
    -------
    dict
        How many both complete, only the one, only the other, and neither; ``p``, how likely it is that the scenes that
        one alone completes fall out at least as unevenly if the laws were equal (McNemar's exact test; None where there
        are none).
    """
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
    """Return the median of paired differences and its 95 % interval, which takes no shape of distribution for granted.

    Parameters
    ----------
    differences : ndarray, shape (n,)
        Finite.

    Returns
    -------
    dict
        ``pairs``, ``median``, ``low`` and ``high``; None where there are too few.
    """
    n = len(differences)
    if not n:
        return {"pairs": 0, "median": None, "low": None, "high": None}
    from scipy.stats import quantile_test

    interval = quantile_test(differences, q=0.0, p=0.5).confidence_interval(CONFIDENCE)
    low, high = (float(x) if np.isfinite(x) else None for x in (interval.low, interval.high))
    return {"pairs": n, "median": float(np.median(differences)), "low": low, "high": high}


def mean_ratio(one: Array, other: Array) -> dict[str, Any]:
    """Return the means of two laws over the same rows, and their ratio with its 95 % interval.

    Parameters
    ----------
    one, other : ndarray, shape (n,)
        Numbers of the same rows, at least 0; rows in which either is none are left out.

    Returns
    -------
    dict
        ``pairs``, the means ``one`` and ``other``, their ``ratio``, and ``low`` and ``high`` of its interval by the
        bootstrap over rows, by percentiles; None where there are no rows, or the other mean is 0.
    """
    there = np.isfinite(one) & np.isfinite(other)
    one, other = one[there], other[there]
    n = len(one)
    if not n:
        return {"pairs": 0, "one": None, "other": None, "ratio": None, "low": None, "high": None}
    found: dict[str, Any] = {"pairs": n, "one": float(one.mean()), "other": float(other.mean())}
    if not found["other"] > 0.0:
        return found | {"ratio": None, "low": None, "high": None}
    rng, ratios = np.random.default_rng(0), np.empty(_RESAMPLES)
    for i in range(_RESAMPLES):
        rows = rng.integers(n, size=n)
        below = other[rows].sum()
        ratios[i] = one[rows].sum() / below if below > 0.0 else np.inf
    tail = 0.5 * (1.0 - CONFIDENCE)
    low, high = (
        float(x) if np.isfinite(x) else None for x in np.quantile(ratios, [tail, 1.0 - tail], method="nearest")
    )
    return found | {"ratio": found["one"] / found["other"], "low": low, "high": high}
