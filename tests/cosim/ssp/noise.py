"""Noise of a packaged controller, by an independent Philox."""

import numpy as np

from tests.plant_fmu.philox import normal

STREAM = 64  # of the first coordinate


class Noise:
    """Standard normal numbers, six at each tick of the law."""

    def __init__(self, seed):
        self.seed, self.tick = seed, -1

    def standard_normal(self, shape):
        return np.reshape([self._row(6) for _ in range(np.prod(shape) // 6)], shape)

    def _row(self, n):
        self.tick += 1
        return np.array([normal(self.seed % 2**31, STREAM + i, self.tick) for i in range(n)])
