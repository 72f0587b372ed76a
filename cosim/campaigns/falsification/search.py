"""Minimize a noisy function over a unit cube, by CMA-ES with restarts."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.errors import RunError
from plant_fmu.installing import install_hint

Evaluate = Callable[[NDArray[np.float64]], NDArray[np.float64]]  # points (n, dimension) → costs (n,)

_FIRST = 0.1  # fraction of the budget for uniformly drawn points, the starts of wide searches
_WIDE, _NARROW = 0.1, 0.02  # initial standard deviations of a search in each coordinate
_PATIENCE = 10  # generations without a lesser cost, after which a search ends


def minimize(evaluate: Evaluate, dimension: int, budget: int, seed: int) -> None:
    """Evaluate a function at `budget` points, most of them near its minimum; evaluate (n, dimension)."""
    # A tenth of them is drawn uniformly. From the best of these starts a CMA-ES with a diagonal covariance (Ros and
    # Hansen 2008), which adapts to some eighty coordinates within a hundred generations. After ten generations without
    # improvement a narrow search starts from the least cost of all, and after it a wide one from the next best drawn
    # point. Each wide one has twice the population of the last (Auger and Hansen 2005).
    cma, rng = import_cma(), np.random.default_rng(seed)
    drawn = rng.random((math.ceil(_FIRST * budget), dimension))
    costs = evaluate(drawn)
    starts = iter(drawn[np.argsort(costs, kind="stable")])
    best_point, best_cost = drawn[np.argmin(costs)], float(costs.min())
    left, wide, small = budget - len(drawn), True, 4 + int(3.0 * math.log(dimension))
    population = small
    while left > 0:
        start = next(starts, rng.random(dimension)) if wide else best_point
        size = population if wide else small
        options = {
            "bounds": [0.0, 1.0], "CMA_diagonal": True, "popsize": size, "seed": np.nan,
            "randn": lambda *shape: rng.standard_normal(shape),
            "signals_filename": "", "verbose": -9, "verb_log": 0, "verb_disp": 0,
        }  # fmt: skip
        strategy = cma.CMAEvolutionStrategy(start, _WIDE if wide else _NARROW, options)
        search_cost, stale = math.inf, 0
        while left > 0 and stale < _PATIENCE and not strategy.stop():
            points = np.array(strategy.ask())[:left]
            costs = evaluate(points)
            left -= len(points)
            if len(points) == size:
                strategy.tell(list(points), costs.tolist())
            best = int(np.argmin(costs))
            stale = 0 if costs[best] < search_cost else stale + 1
            search_cost = min(search_cost, float(costs[best]))
            if search_cost < best_cost:
                best_point, best_cost = points[best], search_cost
        population, wide = (2 * population, False) if wide else (population, True)


def import_cma() -> Any:
    """Import the package cma."""
    try:
        import cma
    except ImportError as error:
        raise RunError(f"a search needs cma (the extra falsify); {install_hint('cma>=4.0')}") from error
    return cma
