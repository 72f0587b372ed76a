"""The probability of a rare event, by adaptive multilevel splitting."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr
from scipy.stats import t

from cosim.campaigns.falsification.search import Evaluate

_PARTICLES = 16  # ratio of budget to particles: enough for about 15 levels, each half as likely
_KEPT = 0.5  # fraction of the particles that are beyond the next level
_MOVES = 2  # proposed moves of every copied particle
_CHANGED = 0.5  # fraction of the coordinates that a move changes
_ACCEPTED = 0.3  # desired acceptance rate of the moves, to which the step is adapted
_GAIN = 2.0  # gain of that adaptation
_SHORTEST = 0.02  # least step of a move [standard deviations]
_TAIL = 0.025  # probability outside the interval on each side
MIN_BUDGET = 100  # minimum number of points


@dataclass(frozen=True)
class Estimate:
    """A probability with its interval."""

    probability: float  # 0 if no point was in the event
    low: float  # lower end of the 95 % interval; 0 if no point was in the event
    high: float  # upper end of the 95 % interval
    levels: tuple[tuple[float, float], ...]  # cost, and probability that it is not exceeded
    families: int  # number of first particles from which the last ones descend: few give a poor estimate


def estimate_probability(evaluate: Evaluate, dimension: int, budget: int, seed: int) -> Estimate:
    """Estimate the probability that the cost of a uniformly drawn point is below 0; evaluate (n, dimension)."""
    # Particles are drawn uniformly. At each level the half with the greater costs is replaced by copies of the others,
    # which a Markov chain then moves to costs no greater than the level that separates the halves: the estimate is the
    # product of the fractions (Au and Beck 2001, Cerou and others 2012). A move changes half of the coordinates, by
    # preconditioned Crank-Nicolson steps in normal numbers, which preserve the distribution. A cost may be random: it
    # is then drawn again with each move.
    #
    # The interval is that of the logarithm, by Student's distribution. Its variance is the sum over the fractions, each
    # between the families of first particles: copies of one are not independent.
    rng = np.random.default_rng(seed)
    n = max(MIN_BUDGET // 5, budget // _PARTICLES)
    z = rng.standard_normal((n, dimension))
    costs, families = evaluate(ndtr(z)), np.arange(n)
    remaining, step, reached, variance, bound = budget - n, 0.5, 1.0, 0.0, 1.0
    levels: list[tuple[float, float]] = []
    while True:
        level = float(np.sort(costs)[int(_KEPT * n) - 1])
        inside = costs <= level
        copied = np.flatnonzero(~inside)
        n_families = len(np.unique(families))
        if level < 0.0 or not len(copied) or remaining < _MOVES * len(copied):
            break
        variance += _relative_variance(inside, families)
        reached *= float(inside.mean())
        levels.append((level, reached))
        bound = min(bound, reached * _factor(variance, n_families))
        parents = np.arange(n)
        parents[copied] = rng.choice(np.flatnonzero(inside), len(copied))
        z, costs, families = z[parents], costs[parents], families[parents]
        for _ in range(_MOVES):
            proposals = math.sqrt(1.0 - step**2) * z[copied] + step * rng.standard_normal((len(copied), dimension))
            proposals = np.where(rng.random(proposals.shape) < _CHANGED, proposals, z[copied])
            new = evaluate(ndtr(proposals))
            remaining -= len(copied)
            accepted = new <= level
            z[copied[accepted]], costs[copied[accepted]] = proposals[accepted], new[accepted]
            step = float(np.clip(step * math.exp(_GAIN * (accepted.mean() - _ACCEPTED)), _SHORTEST, 1.0))
    event = costs < 0.0
    if not event.any():
        upper = 1.0 - _TAIL ** (1.0 / n_families)  # Clopper and Pearson, none of `n_families` families
        bound = min(bound, reached * _factor(variance, n_families) * upper)
        return Estimate(0.0, 0.0, bound, tuple(levels), n_families)
    probability = reached * float(event.mean())
    factor = _factor(variance + _relative_variance(event, families), n_families)
    levels.append((0.0, probability))
    return Estimate(probability, probability / factor, min(1.0, probability * factor), tuple(levels), n_families)


def _factor(variance: float, n_families: int) -> float:
    """Return the factor of the interval about a probability, from its relative variance and number of families."""
    return math.exp(float(t.ppf(1.0 - _TAIL, n_families - 1)) * math.sqrt(variance)) if n_families > 1 else math.inf


def _relative_variance(inside: NDArray[np.bool_], families: NDArray[np.int64]) -> float:
    """Return the squared relative error of a fraction, between independent families."""
    fraction, n_families = inside.mean(), len(np.unique(families))
    sums = np.bincount(families, inside - fraction)
    return float((sums**2).sum() / inside.sum() ** 2 * n_families / max(1, n_families - 1))
