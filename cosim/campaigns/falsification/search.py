from __future__ import annotations
from collections.abc import Callable
import numpy as np

def minimize(evaluate, dimension, budget, seed, sigma=0.1, diagonal=True, first=0.1, patience=20, grow=True, starts_=None):
    import cma
    rng = np.random.default_rng(seed)
    dice = rng.random((max(1, int(first*budget)), dimension))
    costs = evaluate(dice)
    order = iter(dice[np.argsort(costs, kind="stable")])
    left = budget - len(dice)
    pop = 4 + int(3*np.log(dimension))
    log=[]
    while left > 0:
        start = next(order)
        es = cma.CMAEvolutionStrategy(start, sigma, dict(bounds=[0,1], randn=lambda *s: rng.standard_normal(s), seed=np.nan, popsize=pop, CMA_diagonal=diagonal, verbose=-9, verb_log=0, verb_disp=0, signals_filename=""))
        best, stale = np.inf, 0
        while left > 0 and stale < patience and not es.stop():
            pts = np.array(es.ask())[:left]
            c = evaluate(pts); left -= len(pts)
            if len(pts) < es.popsize: break
            es.tell(list(pts), list(c))
            stale = 0 if c.min() < best - 1e-3 else stale+1
            best = min(best, c.min())
        log.append((budget-left, best, dict(es.stop())))
    return log
