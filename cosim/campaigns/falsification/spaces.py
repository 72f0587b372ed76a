"""Scenes as points of a unit cube, so that a search can move among them, and a sampler draw them as they come."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from cosim.campaigns.scenes.generator import MOST_OBSTACLES, draw_scene

_OF_AN_OBSTACLE = 5  # coordinates: radius, place along the way, three of the distance from it

Point = NDArray[np.float64]  # (dimension,) each from 0 to 1


class Shares:
    """Stands for a random number generator: a number drawn is at a given share of its distribution.

    Parameters
    ----------
    shares : ndarray, shape (n,)
        Of the first n numbers, from 0 to 1.
    rest : numpy.random.Generator
        What the numbers after those are drawn from.
    limit : float
        Greatest distance of a normal number from its mean [standard deviations].
    """

    def __init__(self, shares: Point, rest: np.random.Generator, limit: float = np.inf) -> None:
        self._shares, self._rest, self._limit = shares, rest, limit
        self.drawn = 0  # numbers

    def uniform(self, low: Any, high: Any) -> Any:
        """Draw evenly between two bounds, or two lists of them."""
        lows, highs = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
        return np.minimum(lows + (highs - lows) * self._next(lows.shape), highs)[()]

    def normal(self, mean: Any, deviation: Any) -> Any:
        """Draw from normal distributions."""
        deviations = np.asarray(deviation, dtype=float)
        return mean + deviations * np.clip(ndtri(self._next(deviations.shape)), -self._limit, self._limit)

    def integers(self, low: int, high: int) -> int:
        """Draw a whole number from `low` on, below `high`."""
        return min(low + int((high - low) * self._next(())), high - 1)

    def _next(self, shape: tuple[int, ...]) -> Any:
        n = int(np.prod(shape))
        given = self._shares[self.drawn : self.drawn + n]
        self.drawn += n
        return np.concatenate([given, self._rest.random(n - len(given))]).reshape(shape)[()]


class SceneSpace:
    """The scenes of a family of the generator, each a point of a unit cube.

    Points that are drawn evenly give scenes with the generator's own distribution: a coordinate is the share of the
    distribution of one number. An obstacle that leaves too little room around start or goal is drawn again, as by the
    generator, from the scene's seed.

    Parameters
    ----------
    kind : str
        One of `cosim.campaigns.scenes.generator.KINDS`.
    limit : float
        Greatest distance of a normal number from its mean [standard deviations].
    """

    def __init__(self, kind: str, limit: float = np.inf) -> None:
        self.kind, self._limit = kind, limit
        others = Shares(np.empty(0), np.random.default_rng(0))
        obstacle = Shares(np.empty(0), np.random.default_rng(0))
        draw_scene(others, [obstacle] * MOST_OBSTACLES[kind], 0, kind)
        self._others = others.drawn
        self.dimension = self._others + _OF_AN_OBSTACLE * MOST_OBSTACLES[kind]

    def line(self, point: Point, seed: int) -> bytes:
        """Return the scene at a point as a line of JSON.

        Parameters
        ----------
        point : ndarray, shape (dimension,)
            From 0 to 1.
        seed : int
            The scene's own: of its noise, and of obstacles that are drawn again.

        Returns
        -------
        bytes
            As `cosim.campaigns.scenes.scene.decode_scene` reads it.
        """
        rest = np.random.default_rng([seed, 2])
        others, obstacles = point[: self._others], point[self._others :].reshape(-1, _OF_AN_OBSTACLE)
        drawn = [Shares(shares, rest, self._limit) for shares in obstacles]
        scene = draw_scene(Shares(others, rest, self._limit), drawn, seed, self.kind)
        return json.dumps(scene).encode() + b"\n"
