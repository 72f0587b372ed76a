"""Converts rows of a run to rows of a view: drawn columns, active region, and firing strengths of rules."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from cosim.replay.activity import active_at
from cosim.results.record import Rows
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
        self.picked = [i for i, column in enumerate(columns) if is_drawn(column.name)]
        self._scenario, self._drawn = scenario, [columns[i] for i in self.picked]
        system = scenario.rules.system
        self._inputs = [f"membership.{name}" for name in scenario.criterion_names]  # inputs of the rules
        if scenario.arbiter.file:
            self._inputs = [f"arbiter.{signal.name}" for signal in scenario.rules.inputs]
        self._weights = [f"weight.{name}" for name in scenario.criterion_names]
        self._firing = Firing(system)
        self._low, self._high = np.array([variable.universe for variable in system.inputs]).T
        self.columns = (*self._drawn, *added_columns(system))

    def compute_rows(self, picked: Array) -> Array:
        """Compute the rows of a view; picked (rows, picked columns), returns (rows, columns)."""
        rows = Rows(self._drawn, {column.name: values for column, values in zip(self._drawn, picked.T, strict=True)})
        active = active_at(self._scenario, rows).astype(float)
        active[np.isnan(rows.stack(self._weights)).all(axis=1)] = np.nan  # unknown without weights
        inputs = rows.stack(self._inputs)
        numbers = np.isfinite(inputs).all(axis=1)
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
