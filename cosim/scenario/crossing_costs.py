"""Costs of paths through soft regions, computed from the arbiter's preference between pairs of criteria."""

# A planner chooses between regions that are far from each other and from the vehicle, for which the present weights do
# not hold. So the arbiter is evaluated beforehand for each pair of criteria with soft regions: both have membership 1,
# all others 0. The share of a criterion is the mean over its pairs of its part of the two weights. A meter of path
# through a region, half a meter deep, costs `_EQUAL` m at share 1/2, the share of all criteria without preference. At
# share 1 it costs `_PREFERRED` times as much, at share 0 as much less.

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import replace

from controller.regions.region_set import of_attitude
from cosim.scenario.arbiter_rules import ArbiterRules, InputSignal
from cosim.scenario.region_tables import SecondaryRegion
from fuzzy_arbiter import Arbiter, System

_EQUAL = 2.0  # m, cost at share 1/2
_PREFERRED = 5.0  # factor of the cost at share 1


def with_crossing_costs(
    regions: tuple[SecondaryRegion, ...], criteria: Sequence[str], rules: ArbiterRules, depth: float
) -> tuple[SecondaryRegion, ...]:
    """Return the regions with the crossing costs of the soft ones; depth [m]."""
    soft = {r.criterion for r in regions if not r.region.hard and not of_attitude(r.region.shape)}
    if not soft:
        return regions
    of_regions = tuple(region.criterion for region in regions)
    is_soft = tuple(name in soft for name in criteria)
    costs = dict(
        zip(criteria, _costs(rules.system, rules.inputs, tuple(criteria), is_soft, of_regions, depth), strict=True)
    )
    return tuple(replace(r, region=replace(r.region, crossing_cost=costs[r.criterion])) for r in regions)


@functools.lru_cache(maxsize=64)
def _costs(
    system: System,
    inputs: tuple[InputSignal, ...],
    criteria: tuple[str, ...],
    is_soft: tuple[bool, ...],
    of_regions: tuple[str, ...],
    depth: float,
) -> tuple[float, ...]:
    """Return the cost of each criterion [m]."""
    arbiter, indices = Arbiter(system=system), [i for i, soft in enumerate(is_soft) if soft]
    costs = []
    for i in range(len(criteria)):
        shares = []
        for j in indices:
            if i in indices and i != j:
                pressing = {criteria[i], criteria[j]}
                values = [
                    _input(signal, upper.universe[1], pressing, criteria, of_regions, depth)
                    for signal, upper in zip(inputs, system.inputs, strict=False)
                ]
                weights = arbiter(values)
                total = weights[i] + weights[j]
                shares.append(weights[i] / total if total > 0.0 else 0.5)
        share = math.fsum(shares) / len(shares) if shares else 0.5
        costs.append(_EQUAL * _PREFERRED ** (2.0 * share - 1.0))
    return tuple(costs)


def _input(
    signal: InputSignal,
    far: float,
    pressing: set[str],
    criteria: Sequence[str],
    of_regions: Sequence[str],
    depth: float,
) -> float:
    """Return the value of an input while the criteria `pressing` have membership 1; `far` is its upper bound."""
    if signal.kind == "membership":
        return float(criteria[signal.of] in pressing)
    if signal.kind in ("clearance", "approach_time"):  # 0: on the surface
        return 0.0 if signal.of and of_regions[signal.of - 1] in pressing else far
    if signal.kind == "given":
        return signal.course[0][1]
    return depth if signal.kind == "depth" else 0.0
