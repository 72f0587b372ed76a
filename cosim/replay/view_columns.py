"""Converts rows of a run to rows of a view: drawn columns, active region, and firing strengths of rules."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from cosim.replay.activity import RESTING_SIGNALS, active_regions, is_resting
from cosim.results.required_columns import REGION_COLUMNS
from cosim.scenario.scenario import Scenario
from cosim.simulation.signals import Array, Column
from fuzzy_arbiter import System
from fuzzy_arbiter.engines.firing import Firing

_DRAWN = (  # prefixes of the columns that a view draws
    "time", "position.", "quaternion.", "velocity.", "attitude.", "membership.", "weight.", "arbiter.", "estimate.",
    "command.", "thruster_force[", "actuation.", "commands.", "target.", "wrench_saturated", "allocation_saturated",
    "autopilot.", "companion.", "stick.", "velocity_target.", "water_velocity.", "goal.place",
)  # fmt: skip


class ViewColumns:
    """Select the columns that a view draws, and add the active region and the firing strength of each rule."""

    def __init__(self, scenario: Scenario, columns: Sequence[Column]) -> None:
        names = [column.name for column in columns]
        self.picked = [i for i, name in enumerate(names) if is_drawn(name)]
        self._criteria, names_of_criteria = scenario.criterion_places, scenario.criterion_names
        picked = [names[i] for i in self.picked]
        self._memberships = [picked.index(f"membership.{name}") for name in names_of_criteria]
        self._weights = [picked.index(f"weight.{name}") for name in names_of_criteria]
        self._goal, *self._velocity = (picked.index(name) for name in RESTING_SIGNALS)
        self._clearances = [picked.index(f"{secondary.region.name}.clearance") for secondary in scenario.regions]
        system = scenario.rules.system
        self._inputs = self._memberships  # inputs of the rules
        if scenario.arbiter.file:
            self._inputs = [picked.index(f"arbiter.{signal.name}") for signal in scenario.rules.inputs]
        self._firing = Firing(system)
        self._low, self._high = np.array([variable.universe for variable in system.inputs]).T
        self.columns = (
            *(columns[i] for i in self.picked),
            *added_columns(system),
        )

    def compute_rows(self, picked: Array) -> Array:
        """Compute the rows of a view; picked (rows, picked columns), returns (rows, columns)."""
        memberships = picked[:, self._memberships]
        weights, clearances = picked[:, self._weights], picked[:, self._clearances]
        resting = is_resting(picked[:, self._goal], picked[:, self._velocity])
        active = active_regions(self._criteria, memberships, weights, clearances, resting)
        inputs = picked[:, self._inputs]
        numbers = np.isfinite(inputs).all(axis=1)
        active[np.isnan(picked[:, self._weights]).all(axis=1)] = np.nan  # unknown without weights
        strengths = np.full((len(picked), len(self.columns) - len(self.picked) - 1), np.nan)
        if numbers.any():
            strengths[numbers] = np.column_stack(
                self._firing.strengths(np.clip(inputs[numbers], self._low, self._high))
            )
        return np.column_stack([picked, active, strengths])


def added_columns(system: System) -> Iterator[Column]:
    """Yield the columns that a view adds to those of the record."""
    yield Column("active", "", "Region that the arbiter gives way to: 0 the goal, then the regions in their order")
    for i, rule in enumerate(system.rules):
        yield Column(f"rule.R{i + 1}", "", f"Strength of: {rule}")


def is_drawn(name: str) -> bool:
    """Return True if a view draws a column of the record."""
    return name.startswith(_DRAWN) or name.endswith(REGION_COLUMNS)
