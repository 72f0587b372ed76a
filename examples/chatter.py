"""Chatter of an arbiter's weights on the border of a region, and ways to reduce it.

In the vertical plane of the paper's scene a vehicle goes to the surface of the obstacle, holds its station there, and
goes back, in a band of depths that it should leave all the while. Its position is measured with noise, so that on the
border a crisp decision changes at every other step. The total variation adds up how much the weights change from step
to step; two changes of the region that matters make 4 of it, all the rest is chatter.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fuzzy_arbiter import Arbiter, falling
from fuzzy_arbiter.criteria import SECTION_VI, Criterion, HysteresisArbiter

Array = NDArray[np.float64]
Decide = Callable[[Array, Array], Array]

STEP, NOISE, SEED = 0.001, 0.01, 1  # s, m in each direction, seed of the noise
START, STATION = np.array([0.5, 1.8]), np.array([1.5, 1.8])  # x and depth, m
TIMES, PLACES = [0.0, 1.0, 4.0, 5.0], [0.0, 1.0, 1.0, 0.0]  # s, share of the way from the start to the station
OBSTACLE, SHAPE, RADIUS = np.array([2.0, 1.8]), np.array([2.0, 2.2]), 0.5  # centers and radius of the spheres, m
BAND, HALF_BAND = 2.5, 1.8  # middle of the band of depths and half of its width, m


def measured(noise: float = NOISE) -> tuple[Array, Array]:
    """Return the times [s], and at each the measured clearances to the three regions [m], positive outside."""
    times = np.arange(0.0, TIMES[-1], STEP)
    path = START + np.interp(times, TIMES, PLACES)[:, None] * (STATION - START)
    path = path + noise * np.random.default_rng(SEED).standard_normal(path.shape)
    spheres = [np.linalg.norm(path - center, axis=1) - RADIUS for center in (OBSTACLE, SHAPE)]
    return times, np.column_stack([*spheres, np.abs(path[:, 1] - BAND) - HALF_BAND])


def on_clearances(start: float, end: float) -> Arbiter:
    """Return the arbiter whose criteria are on where the clearance is below `start`, and off above `end` [m]."""
    ramp = falling(start, end)
    criteria = [Criterion(c.name, on=c.on, off=c.off, membership=ramp) for c in SECTION_VI]
    return Arbiter(criteria, outside="clip")


def ways() -> dict[str, Decide]:
    """Return the ways to decide, by name: functions from clearances and times to weights, a row for each step."""
    crisp, outside, near = Arbiter(), on_clearances(0.0, 0.1), on_clearances(0.0, 0.05)
    narrow, wide = on_clearances(-0.05, 0.05), on_clearances(-0.15, 0.15)
    latched = HysteresisArbiter(near, enter=1.0, release=0.0)
    eased = HysteresisArbiter(near, enter=1.0, release=0.0, graded=True)
    held = HysteresisArbiter(crisp, enter=1.0, release=0.0, dwell=0.1)
    return {
        "crisp": lambda clearances, times: crisp.batch(clearances <= 0.0),
        "ramp across the border, 5 cm to each side": lambda clearances, times: narrow.batch(clearances),
        "ramp across the border, 15 cm to each side": lambda clearances, times: wide.batch(clearances),
        "ramp outside the border, 10 cm": lambda clearances, times: outside.batch(clearances),
        "hysteresis, release 5 cm outside": latched.scan,
        "the same, and a ramp before it": eased.scan,
        "crisp, dwell 0.1 s": lambda clearances, times: held.scan(clearances <= 0.0, times),
    }


def variation(weights: Array) -> float:
    """Return the total variation of weights over time, summed over the criteria."""
    return float(np.abs(np.diff(weights, axis=0)).sum())


def switches(weights: Array) -> int:
    """Return the number of times that the obstacle's weight passes 1/2."""
    return int(np.count_nonzero(np.diff(weights[:, 0] > 0.5)))


def table() -> list[tuple[str, float, int, float]]:
    """Return the name, total variation, switches, and total variation without noise of each way."""
    times, clearances = measured()
    _, true = measured(noise=0.0)
    rows = []
    for name, decide in ways().items():
        weights, quiet = decide(clearances, times), ways()[name](true, times)
        rows.append((name, variation(weights), switches(weights), variation(quiet)))
    return rows


if __name__ == "__main__":
    print(f"{'decision':<44}{'total variation':>17}{'switches':>10}{'without noise':>15}")
    for name, whole, count, quiet in table():
        print(f"{name:<44}{whole:>17.1f}{count:>10}{quiet:>15.1f}")
