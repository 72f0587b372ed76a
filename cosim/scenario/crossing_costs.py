"""What a path through a soft region costs: by the arbiter, which is asked which of two criteria it would give up.

A planner chooses between regions that are far from each other, and from the vehicle: the weights of the moment say
nothing of that. So the arbiter is asked beforehand: of each pair of criteria that have soft regions, both press in
full, and nothing else does. The share of a criterion is the mean, over the pairs that it is in, of its part of the two
weights. A metre of path through a region, half a metre deep, costs `_EQUAL` m at a share of one half, which is what
all get where the arbiter prefers none, and a factor `_PREFERRED` more, or less, at a share of 1, or 0.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import replace

from controller.regions.region_set import of_attitude
from cosim.scenario.arbiter_rules import ArbiterRules, InputSignal
from cosim.scenario.tables import SecondaryRegion
from fuzzy_arbiter import Arbiter, System

_EQUAL = 2.0  # m
_PREFERRED = 5.0


def with_crossing_costs(
    regions: tuple[SecondaryRegion, ...], criteria: Sequence[str], rules: ArbiterRules, depth: float
) -> tuple[SecondaryRegion, ...]:
    """Return regions with what a path through each costs, where it is soft.

    Parameters
    ----------
    regions : tuple of SecondaryRegion
        Of the scenario.
    criteria : sequence of str
        Their names, the first in priority first.
    rules : ArbiterRules
        That weigh them.
    depth : float
        Of the vehicle at the start [m], for rules that ask for it; its speed is 0, the time 0.
    """
    soft = {r.criterion for r in regions if not r.region.hard and not of_attitude(r.region.shape)}
    if not soft:
        return regions
    of_regions = tuple(region.criterion for region in regions)
    asked = tuple(name in soft for name in criteria)
    costs = dict(
        zip(criteria, _costs(rules.system, rules.inputs, tuple(criteria), asked, of_regions, depth), strict=True)
    )
    return tuple(replace(r, region=replace(r.region, crossing_cost=costs[r.criterion])) for r in regions)


@functools.lru_cache(maxsize=64)
def _costs(
    system: System,
    inputs: tuple[InputSignal, ...],
    criteria: tuple[str, ...],
    asked: tuple[bool, ...],
    of_regions: tuple[str, ...],
    depth: float,
) -> tuple[float, ...]:
    """Return the cost of each criterion [m]."""
    arbiter, places = Arbiter(system=system), [i for i, ask in enumerate(asked) if ask]
    costs = []
    for i in range(len(criteria)):
        shares = []
        for j in places:
            if i in places and i != j:
                pressing = {criteria[i], criteria[j]}
                asks = [
                    _input(signal, upper.universe[1], pressing, criteria, of_regions, depth)
                    for signal, upper in zip(inputs, system.inputs, strict=False)
                ]
                weights = arbiter(asks)
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
    """Return what an input gets while two criteria press in full, and the vehicle is at rest; `far` is its greatest."""
    if signal.kind == "membership":
        return float(criteria[signal.of] in pressing)
    if signal.kind in ("clearance", "approach_time"):  # 0: on the surface
        return 0.0 if signal.of and of_regions[signal.of - 1] in pressing else far
    if signal.kind == "given":
        return signal.course[0][1]
    return depth if signal.kind == "depth" else 0.0
