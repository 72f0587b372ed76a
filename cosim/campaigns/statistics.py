"""Numbers that pages and summaries have in common: rates with intervals, quantiles, bins, paired differences.

SciPy's statistics take as long to import as all else that a worker needs, and no worker needs them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cosim.signals import Array

Facts = NDArray[np.bool_]

CONFIDENCE = 0.95
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
_BINS = 6  # at the most; fewer distinct values have one each


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
    distinct = np.unique(values)
    if len(distinct) <= _BINS:
        of = np.searchsorted(distinct, values)
    else:
        edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, _BINS + 1)[1:-1]))
        of = np.searchsorted(edges, values, side="left")
    for i in np.unique(of):
        rows = of == i
        own = values[rows]
        yield Bin(float(own.min()), float(own.max()), float(np.median(own)), rows)


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
