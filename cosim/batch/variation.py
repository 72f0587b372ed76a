"""Variation of numbers of a scenario, and the scenario for given values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from controller import ControllerError
from cosim.errors import ScenarioError
from cosim.scenario.changes import join_keys, value_at, with_values
from cosim.scenario.scenario import Scenario, validate_scenario
from cosim.scenario.toml_file import current_key, plain_key
from plant_fmu.errors import PlantFmuError

_SEEDS = ("sensing.seed", "plant.parameters.seed")  # keys that get the seed of a row


class Variation:
    """A scenario of which some numbers vary. It is picklable."""

    def __init__(self, scenario: Scenario, keys: Sequence[str]) -> None:
        self.base, self.keys = scenario, tuple(map(plain_key, keys))
        current_keys = [current_key(scenario.table, key) for key in self.keys]
        for i, key in enumerate(self.keys):
            if current_keys[i] in current_keys[:i]:
                raise ScenarioError(f"key {key!r} comes twice, expected each once")
            number = self.number(key)
            if isinstance(number, bool) or not isinstance(number, int | float):
                raise ScenarioError(f"key {key!r} is {number!r}, expected a number")
        self._seeds = tuple(seed for seed in _SEEDS if seed not in self.keys and self._has(seed))

    def number(self, key: str) -> Any:
        """Return the base's value of a key, defaults included."""
        return value_at(self.base.table, key, self.base.vehicle)

    def scenario(self, values: Sequence[float], seed: int) -> Scenario:
        """Make the scenario for values and a seed."""
        changes: dict[str, float | int] = {
            key: _convert(self.number(key), float(value), key) for key, value in zip(self.keys, values, strict=True)
        }
        changes |= dict.fromkeys(self._seeds, int(seed))
        table = with_values(self.base.table, changes)
        changed = (current_key(table, key) for key, value in changes.items() if value != self.number(key))
        table["changed"] = join_keys(table["changed"], changed)
        try:
            return validate_scenario(table, self.base.name, self.base.vehicle)
        except (PlantFmuError, ControllerError) as error:
            raise ScenarioError(str(error)) from error

    def _has(self, key: str) -> bool:
        try:
            self.number(key)
        except ScenarioError:
            return False
        return True


def _convert(like: float | int, value: float, key: str) -> float | int:
    """Convert a value to int if the key has one; numbers of shapes may be written as int, but are floats."""
    if isinstance(like, float) or key.startswith("goal.") or ".shape." in key:
        return value
    if not (math.isfinite(value) and value == round(value)):
        raise ScenarioError(f"{key} is {value}, expected a whole number")
    return round(value)
