"""FMPy's `simulate_ssp`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fmpy.ssp.simulation import simulate_ssp


def steps(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that simulates so many steps in one call, which also loads and unpacks."""
    h = setup["step"]
    return lambda count: simulate_ssp(setup["ssp"], stop_time=(count - 0.5) * h, step_size=h)


def runs(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that simulates so many whole runs, each of which loads and unpacks."""
    whole, one = round(setup["duration"] / setup["step"]), steps(setup)

    def work(count: int) -> None:
        for _ in range(count):
            one(whole)

    return work
