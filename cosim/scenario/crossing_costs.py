"""Costs of paths through soft regions, computed from the arbiter's preference between pairs of criteria."""

# A planner chooses between regions that are far from each other and from the vehicle, for which the present weights do
# not hold. So the arbiter is evaluated beforehand for each pair of criteria with soft regions: both have membership 1,
# all others 0. The preference of a criterion is the mean over its pairs of its part of the two weights. A meter of path
# through a region, half a meter deep, costs `_EQUAL` m at preference 1/2, that of equal criteria. At
# preference 1 it costs `_PREFERRED` times as much, at preference 0 as much less.

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import replace

from controller.regions.region_set import of_attitude
from cosim.scenario.arbiter_rules import ArbiterRules, InputSignal
from cosim.scenario.region_tables import SecondaryRegion
from fuzzy_arbiter import Arbiter

_EQUAL = 2.0  # m, cost at preference 1/2
_PREFERRED = 5.0  # factor of the cost at preference 1


def with_crossing_costs(
    regions: tuple[SecondaryRegion, ...], criteria: Sequence[str], rules: ArbiterRules, depth: float
) -> tuple[SecondaryRegion, ...]:
    """Return the regions with the crossing costs of the soft ones; depth [m]."""
    soft = {r.criterion for r in regions if not r.region.hard and not of_attitude(r.region.shape)}
    if not soft:
        return regions
    of_regions = tuple(region.criterion for region in regions)
    costs = _costs(rules, tuple(criteria), tuple(name for name in criteria if name in soft), of_regions, depth)
    return tuple(replace(r, region=replace(r.region, crossing_cost=costs.get(r.criterion, _EQUAL))) for r in regions)


@functools.lru_cache(maxsize=64)
def _costs(
    rules: ArbiterRules, criteria: tuple[str, ...], soft: tuple[str, ...], of_regions: tuple[str, ...], depth: float
) -> dict[str, float]:
    """Return the cost of each criterion with soft regions [m]."""
    arbiter = Arbiter(rules.system)

    def value(signal: InputSignal, far: float, pressing: Sequence[str]) -> float:
        """Return the value of an input while two criteria have membership 1; `far` is its upper bound."""
        if signal.kind == "membership":
            return float(criteria[signal.of] in pressing)
        if signal.kind in ("clearance", "approach_time"):  # 0: on the surface
            return 0.0 if signal.of and of_regions[signal.of - 1] in pressing else far
        if signal.kind == "given":
            return signal.course[0][1]
        return depth if signal.kind == "depth" else 0.0

    def preference(*pair: str) -> float:
        inputs = zip(rules.inputs, rules.system.inputs, strict=False)
        weights = arbiter([value(signal, variable.universe[1], pair) for signal, variable in inputs])
        one, other = (weights[criteria.index(name)] for name in pair)
        return one / (one + other) if one + other > 0.0 else 0.5

    costs = {}
    for name in soft:
        preferences = [preference(name, other) for other in soft if other != name] or [0.5]
        costs[name] = _EQUAL * _PREFERRED ** (2.0 * math.fsum(preferences) / len(preferences) - 1.0)
    return costs
