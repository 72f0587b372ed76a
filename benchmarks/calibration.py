"""Calibration of force limit and lag to the paper's window; it is not a finding.

The paper says when the vehicle is inside the intersection of its regions, but not what its actuators give. Here both
ends of that window are fitted by least squares over a limit on the body force, followed by a first-order lag.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from cosim.errors import ScenarioError
from cosim.results.paper_claims import PAPER_WINDOW
from cosim.scenario.scenario import Limit, Scenario, Time, load_scenario
from cosim.simulation.master import Master
from cosim.simulation.signals import Array, Signals

FORCE_BOUNDS = (50.0, 1000.0)  # N, bounds of the fitted force limit
LAG_BOUNDS = (0.0, 2.0)  # s, bounds of the fitted lag

_DURATION = 6.0  # s, twice what the paper's window takes
_GRID = (13, 9)  # number of forces, evenly in their logarithm, and of lags
_MISSED = 10.0  # s, residual of a path that misses the overlap


@dataclass(frozen=True)
class Fit:
    """The fitted limit and lag, and the window that they give."""

    force: float  # N, limit on the body force
    time_constant: float  # s, lag behind the limit
    window: tuple[float, float]  # s, entry into the overlap and exit
    cost: float  # s2, half the sum of squares


class _Overlap:
    """Observer that interpolates the times at which the vehicle enters and leaves the overlap of regions."""

    def __init__(self, signals: Signals, names: list[str]) -> None:
        self._at = [signals.index(f"{name}.clearance") for name in names]
        self._before: tuple[float, float] | None = None
        self.entered = self.left = math.nan

    def observe(self, k: int, row: Array) -> None:
        now, worst = float(row[0]), float(row[self._at].max())
        if self._before is not None:
            then, was = self._before
            if was >= 0.0 > worst and math.isnan(self.entered):
                self.entered = then + (now - then) * was / (was - worst)
            elif was < 0.0 <= worst and math.isnan(self.left):
                self.left = then + (now - then) * was / (was - worst)
        self._before = (now, worst)


def window(scenario: Scenario, force: float, time_constant: float) -> tuple[float, float]:
    """Return the times at which the vehicle enters and leaves the overlap [s], NaN for never; force [N], lag [s]."""
    step = scenario.time.step
    steps = round(_DURATION / step)
    limited = dataclasses.replace(
        scenario,
        limit=Limit(force, time_constant),
        time=Time(steps * step, step, scenario.time.control, scenario.time.arbiter),
        steps=steps,
    )
    with Master(limited) as master:
        names = [scenario.regions[i].region.name for i in scenario.intersection]
        overlap = _Overlap(master.signals, names)
        master.run([overlap])
    return overlap.entered, overlap.left


def calibrate(scenario: Scenario) -> Fit:
    """Fit limit and lag to the paper's window."""
    if scenario.actuation.through != "wrench":
        raise ScenarioError(
            "actuation.through is 'thrusters', expected 'wrench': limit and lag are of the direct force"
        )
    if not scenario.intersection:
        raise ScenarioError("intersection: names no regions, expected those whose overlap is to be fitted")

    def residuals(x: Array) -> Array:
        errors = np.array(window(scenario, math.exp(x[0]), x[1])) - PAPER_WINDOW
        return np.where(np.isnan(errors), _MISSED, errors)

    starts = [
        np.array([x, y])
        for x in np.linspace(math.log(FORCE_BOUNDS[0]), math.log(FORCE_BOUNDS[1]), _GRID[0])
        for y in np.linspace(*LAG_BOUNDS, _GRID[1])
    ]
    best = min(starts, key=lambda x: float(np.sum(residuals(x) ** 2)))
    bounds = tuple(np.array(pair) for pair in zip(np.log(FORCE_BOUNDS), LAG_BOUNDS, strict=True))
    inside = np.clip(best, bounds[0] + 1e-6, bounds[1] - 1e-6)
    fit = least_squares(residuals, inside, bounds=bounds, diff_step=1e-3, x_scale=[1.0, 0.5], xtol=1e-6)
    if np.any(np.abs(fit.fun) >= _MISSED):
        raise ScenarioError("no limit and lag within the bounds bring the vehicle through the overlap in time")
    force, time_constant = math.exp(fit.x[0]), float(fit.x[1])
    return Fit(force, time_constant, window(scenario, force, time_constant), float(fit.cost))


def main() -> None:
    """Print the fit of the scenario ``paper``."""
    fit = calibrate(load_scenario("paper", ["arbiter.engine=closed"]))
    print(f"limit.force = {fit.force:.1f} N, limit.time_constant = {fit.time_constant:.3f} s")
    print(f"window {fit.window[0]:.3f} s to {fit.window[1]:.3f} s, least-squares cost {fit.cost:.3e} s2")
