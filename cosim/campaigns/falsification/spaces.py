"""Scenes as points of a unit cube, for a search or a sampler."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from cosim.campaigns.scenes.conflicts import CONFLICTS, draw_conflict
from cosim.campaigns.scenes.generator import MAX_OBSTACLES, draw_scene

FAMILIES = (*MAX_OBSTACLES, *CONFLICTS)
_N_SEEDS = 2**31  # number of seeds of noise, and of obstacles that are drawn again
_TRIAL_DRAWS = 64  # number of conflicts that are drawn to find the number of their coordinates
_OBSTACLE_COORDINATES = 5  # radius, position along the straight line, and three of the offset from it
_FINITE = 38.5  # standard deviations, beyond all quantiles of floats between 0 and 1; those of 0 and 1 are infinite

Point = NDArray[np.float64]  # (dimension,) coordinates from 0 to 1


class QuantileGenerator:
    """Replacement of a random number generator: each number is a given quantile of its distribution; quantiles (n,)."""

    def __init__(self, quantiles: Point, fallback: np.random.Generator, limit: float = _FINITE) -> None:
        self._quantiles, self._fallback, self._limit = quantiles, fallback, limit
        self.drawn = 0  # count of numbers drawn so far

    def uniform(self, low: Any = 0.0, high: Any = 1.0, size: int | None = None) -> Any:
        """Draw uniformly between two bounds, or two lists of bounds; or `size` numbers."""
        lows, highs = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
        return np.minimum(lows + (highs - lows) * self._next(lows.shape if size is None else (size,)), highs)[()]

    def normal(self, mean: Any, deviation: Any) -> Any:
        """Draw from normal distributions."""
        deviations = np.asarray(deviation, dtype=float)
        return mean + deviations * np.clip(ndtri(self._next(deviations.shape)), -self._limit, self._limit)

    def integers(self, low: int, high: int | None = None) -> int:
        """Draw an integer from `low` to below `high`; or from 0 to below a single bound."""
        low, high = (0, low) if high is None else (low, high)
        return min(low + int((high - low) * self._next(())), high - 1)

    def permutation(self, n: int) -> NDArray[np.int64]:
        """Draw a permutation of the numbers from 0 to below `n`."""
        return np.argsort(self._next((n,)), kind="stable")

    def choice(self, n: int, size: int, replace: bool) -> NDArray[np.int64]:
        """Draw `size` different numbers from 0 to below `n`."""
        if replace:
            raise NotImplementedError("numbers that may come twice")
        return self.permutation(n)[:size]

    def _next(self, shape: tuple[int, ...]) -> Any:
        n = int(np.prod(shape))
        given = self._quantiles[self.drawn : self.drawn + n]
        self.drawn += n
        return np.concatenate([given, self._fallback.random(n - len(given))]).reshape(shape)[()]


class SceneSpace:
    """The scenes of a family of the generator, each a point of a unit cube."""

    # Uniformly drawn points give scenes with the generator's own distribution: a coordinate is the quantile of one
    # number. An obstacle too close to start or goal is drawn again, as by the generator.

    def __init__(self, family: str, limit: float | None = None) -> None:
        self.family, self._limit = family, _FINITE if limit is None else limit
        self._seed_in_point = limit is None
        rng = np.random.default_rng(0)
        if family in MAX_OBSTACLES:
            generators = [QuantileGenerator(np.empty(0), rng)]
            draw_scene(generators[0], [QuantileGenerator(np.empty(0), rng)] * MAX_OBSTACLES[family], 0, family)
        else:
            generators = [QuantileGenerator(np.empty(0), rng) for _ in range(_TRIAL_DRAWS)]
            for generator in generators:
                draw_conflict(generator, 0, family)
        self._n_other = max(generator.drawn for generator in generators)
        self._n_of_obstacles = _OBSTACLE_COORDINATES * MAX_OBSTACLES.get(family, 0)
        self.dimension = self._n_other + self._n_of_obstacles + self._seed_in_point

    def line(self, point: Point, seed: int) -> bytes:
        """Return the scene at a point as a line of JSON; point (dimension,)."""
        noise_seed = int(point[-1] * _N_SEEDS) if self._seed_in_point else seed
        fallback = np.random.default_rng([noise_seed, 2])
        others = QuantileGenerator(point[: self._n_other], fallback, self._limit)
        if self.family in MAX_OBSTACLES:
            obstacles = point[self._n_other : self._n_other + self._n_of_obstacles].reshape(-1, _OBSTACLE_COORDINATES)
            # one generator per obstacle: redrawing one does not change another
            fallbacks = [
                np.random.default_rng([noise_seed, 2, i]) if self._seed_in_point else fallback
                for i in range(len(obstacles))
            ]
            drawn = [QuantileGenerator(*pair, self._limit) for pair in zip(obstacles, fallbacks, strict=True)]
            scene = draw_scene(others, drawn, seed, self.family)
            if self._seed_in_point:
                scene["noise"]["seed"] = noise_seed
        else:
            scene = draw_conflict(others, seed, self.family)
            if self._seed_in_point:
                scene["scenario"]["sensing"]["seed"] = noise_seed
        return json.dumps(scene).encode() + b"\n"
