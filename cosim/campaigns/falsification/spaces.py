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
_CHANCES = 2**31  # number of seeds of noise, and of obstacles that are drawn again
_CONFLICTS = 64  # number of conflicts that are drawn to find the number of their coordinates
_OBSTACLE_COORDINATES = (
    5  # coordinates of an obstacle: radius, position along the straight line, three of its offset from it
)
_FINITE = 38.5  # standard deviations, beyond all quantiles of floats between 0 and 1; those of 0 and 1 are infinite

Point = NDArray[np.float64]  # (dimension,) coordinates from 0 to 1


class Shares:
    """Replacement of a random number generator: each number is a given quantile of its distribution; shares (n,)."""

    def __init__(self, shares: Point, rest: np.random.Generator, limit: float = _FINITE) -> None:
        self._shares, self._rest, self._limit = shares, rest, limit
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
        given = self._shares[self.drawn : self.drawn + n]
        self.drawn += n
        return np.concatenate([given, self._rest.random(n - len(given))]).reshape(shape)[()]


class SceneSpace:
    """The scenes of a family of the generator, each a point of a unit cube."""

    # Uniformly drawn points give scenes with the generator's own distribution: a coordinate is the quantile of one
    # number. An obstacle too close to start or goal is drawn again, as by the generator.

    def __init__(self, family: str, limit: float | None = None) -> None:
        self.family, self._limit = family, _FINITE if limit is None else limit
        self._chance_in_point = limit is None
        rng = np.random.default_rng(0)
        if family in MAX_OBSTACLES:
            several = [Shares(np.empty(0), rng)]
            draw_scene(several[0], [Shares(np.empty(0), rng)] * MAX_OBSTACLES[family], 0, family)
        else:
            several = [Shares(np.empty(0), rng) for _ in range(_CONFLICTS)]
            for shares in several:
                draw_conflict(shares, 0, family)
        self._others = max(shares.drawn for shares in several)
        self._of_obstacles = _OBSTACLE_COORDINATES * MAX_OBSTACLES.get(family, 0)
        self.dimension = self._others + self._of_obstacles + self._chance_in_point

    def line(self, point: Point, seed: int) -> bytes:
        """Return the scene at a point as a line of JSON; point (dimension,)."""
        chance = int(point[-1] * _CHANCES) if self._chance_in_point else seed
        rest = np.random.default_rng([chance, 2])
        others = Shares(point[: self._others], rest, self._limit)
        if self.family in MAX_OBSTACLES:
            obstacles = point[self._others : self._others + self._of_obstacles].reshape(-1, _OBSTACLE_COORDINATES)
            # one generator per obstacle: redrawing one does not change another
            again = [
                np.random.default_rng([chance, 2, i]) if self._chance_in_point else rest for i in range(len(obstacles))
            ]
            drawn = [Shares(shares, of, self._limit) for shares, of in zip(obstacles, again, strict=True)]
            scene = draw_scene(others, drawn, seed, self.family)
            if self._chance_in_point:
                scene["noise"]["seed"] = chance
        else:
            scene = draw_conflict(others, seed, self.family)
            if self._chance_in_point:
                scene["scenario"]["sensing"]["seed"] = chance
        return json.dumps(scene).encode() + b"\n"
