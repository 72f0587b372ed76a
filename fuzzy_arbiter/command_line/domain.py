"""Find where a system's outputs are defined, and draw random samples there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fuzzy_arbiter.definition import System
from fuzzy_arbiter.engines.firing import Array, Firing


def defined(system: System, samples: Array) -> NDArray[np.bool_]:
    """Return a mask of the samples at which every output has a value.

    Parameters
    ----------
    system : System
        System to evaluate.
    samples : ndarray, shape (n, inputs)
        Values in their universes.

    Returns
    -------
    ndarray of bool, shape (n,)
        False where for an output without default no rule fires.
    """
    result = np.ones(len(samples), dtype=np.bool_)
    if len(samples) == 0:
        return result
    firing = Firing(system)
    cuts_of_outputs = firing.cuts_of_many(firing.strengths_of_many(samples))
    for output, cuts in zip(system.outputs, cuts_of_outputs, strict=True):
        if output.default is None:
            result &= cuts.any(axis=0)
    return result


def random_samples(system: System, n: int, seed: int = 0) -> Array:
    """Return samples at random places of the universes, at which every output has a value.

    Parameters
    ----------
    system : System
        System whose inputs are sampled.
    n : int
        Number of samples; fewer are returned where outputs are undefined at some.
    seed : int
        Seed of the random numbers; equal seeds give equal samples.

    Returns
    -------
    ndarray, shape (n or fewer, inputs)
        Values of the inputs; equal seeds give equal values.
    """
    low, high = np.array([v.universe for v in system.inputs]).T
    samples: Array = np.random.default_rng(seed).uniform(low, high, (n, len(system.inputs)))
    return samples[defined(system, samples)]
