"""The least of a noisy function over a unit cube, by CMA-ES that begins again where it stalls."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.errors import RunError
from plant_fmu.installing import install_hint

Evaluate = Callable[[NDArray[np.float64]], NDArray[np.float64]]  # points (n, dimension) → costs (n,)

_FIRST = 0.1  # share of the budget that is drawn evenly: where searches begin
_SPREAD = 0.1  # of a search when it begins, of each coordinate
_PATIENCE = 20  # generations without a lesser cost, after which a search begins elsewhere


def minimize(evaluate: Evaluate, dimension: int, budget: int, seed: int) -> None:
    """Evaluate a function at as many points as the budget has, ever more of them where it is least.

    A tenth of them is drawn evenly. From the best of those begins a CMA-ES with a diagonal covariance (Ros and Hansen
    2008), which follows some eighty coordinates within a hundred generations. Where 20 generations bring nothing, the
    next best begins another one with twice the population (Auger and Hansen 2005).

    Parameters
    ----------
    evaluate : callable
        Points, shape (n, dimension), each coordinate from 0 to 1; returns their finite costs, shape (n,).
    dimension : int
        How many coordinates.
    budget : int
        How many points.
    seed : int
        Of the search; the same one gives the same points where the costs are the same.

    Raises
    ------
    RunError
        If the package cma is not installed.
    """
    cma, rng = import_cma(), np.random.default_rng(seed)
    drawn = rng.random((math.ceil(_FIRST * budget), dimension))
    starts = iter(drawn[np.argsort(evaluate(drawn), kind="stable")])
    left, population = budget - len(drawn), 4 + int(3.0 * math.log(dimension))
    while left > 0:
        start = next(starts, None)
        options = {
            "bounds": [0.0, 1.0], "CMA_diagonal": True, "popsize": population, "seed": np.nan,
            "randn": lambda *shape: rng.standard_normal(shape),
            "signals_filename": "", "verbose": -9, "verb_log": 0, "verb_disp": 0,
        }  # fmt: skip
        strategy = cma.CMAEvolutionStrategy(rng.random(dimension) if start is None else start, _SPREAD, options)
        least, stale = math.inf, 0
        while left > 0 and stale < _PATIENCE and not strategy.stop():
            points = np.array(strategy.ask())[:left]
            costs = evaluate(points)
            left -= len(points)
            if len(points) == population:
                strategy.tell(list(points), costs.tolist())
            stale = 0 if costs.min() < least else stale + 1
            least = min(least, float(costs.min()))
        population *= 2


def import_cma() -> Any:
    """Import the package cma, or say how to get it.

    Raises
    ------
    RunError
        If it is not installed.
    """
    try:
        import cma
    except ImportError as error:
        raise RunError(f"a search needs cma (the extra falsify); {install_hint('cma>=4.0')}") from error
    return cma
