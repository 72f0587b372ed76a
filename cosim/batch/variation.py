"""Which numbers of a scenario vary, and the scenario that any choice of them makes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

from controller import ControllerError
from cosim.errors import ScenarioError
from cosim.scenario.changes import joined, value_at
from cosim.scenario.key_names import PARAMETERS
from cosim.scenario.scenario import Scenario, validate_scenario
from cosim.scenario.toml_file import place_of
from plant_fmu.errors import PlantFmuError

_SEEDS = ("sensing.seed", "plant.parameters.seed")  # what the seed of a row becomes


class Variation:
    """A scenario of which some numbers vary. It can be pickled.

    Parameters
    ----------
    scenario : Scenario
        What stays.
    keys : sequence of str
        Of numbers, with dots as in ``--set``: items of lists go by index, regions by name as well; such as
        ``"initial.position.0"``, ``"regions.SR1.gain"``, ``"law.gains.k_p1"``, ``"plant.parameters.weight"``.

    Attributes
    ----------
    base : Scenario
        What stays.
    keys : tuple of str
        In the order of their values.

    Raises
    ------
    ScenarioError
        If a key is unknown, comes twice, or what it names is no number.
    """

    def __init__(self, scenario: Scenario, keys: Sequence[str]) -> None:
        self.base, self.keys = scenario, tuple(keys)
        for i, key in enumerate(self.keys):
            if key in self.keys[:i]:
                raise ScenarioError(f"key {key!r} comes twice, expected each once")
            number = self.number(key)
            if isinstance(number, bool) or not isinstance(number, int | float):
                raise ScenarioError(f"key {key!r} is {number!r}, expected a number")
        self._seeds = tuple(seed for seed in _SEEDS if seed not in self.keys and self._has(seed))

    def number(self, key: str) -> Any:
        """Return what the scenario has at a key, its defaults included.

        Parameters
        ----------
        key : str
            As in `keys`.

        Returns
        -------
        float, or whatever stands there
            In the key's own unit.

        Raises
        ------
        ScenarioError
            If there is no such key.
        """
        return value_at(self.base.table, key, self.base.vehicle)

    def scenario(self, values: Sequence[float], seed: int) -> Scenario:
        """Return the scenario that values and a seed make.

        Parameters
        ----------
        values : sequence of float
            One for each key, in its unit.
        seed : int
            Of the noise that is measured, and of the plant's random parts.

        Returns
        -------
        Scenario
            The checked scenario.

        Raises
        ------
        ScenarioError
            If a value cannot be; it names the key.
        """
        table = _copy(self.base.table)
        changes = dict(self._changes(values, seed))
        for key, value in changes.items():
            if key.startswith(PARAMETERS):
                table["plant"]["parameters"][key.removeprefix(PARAMETERS)] = value
            else:
                at, last = place_of(table, key)
                at[last] = value
        table["changed"] = joined(table["changed"], (k for k, value in changes.items() if value != self.number(k)))
        try:
            return validate_scenario(table, self.base.name, self.base.vehicle)
        except (PlantFmuError, ControllerError) as error:
            raise ScenarioError(str(error)) from error

    def overrides(self, values: Sequence[float], seed: int) -> list[str]:
        """Return what makes the same scenario of the base, as ``--set`` takes it.

        Parameters
        ----------
        values : sequence of float
            One for each key.
        seed : int
            As for `scenario`.

        Returns
        -------
        list of str
            ``key=value``, to the last bit.
        """
        return [f"{key}={value!r}" for key, value in self._changes(values, seed)]

    def _changes(self, values: Sequence[float], seed: int) -> Iterator[tuple[str, float | int]]:
        for key, value in zip(self.keys, values, strict=True):
            yield key, _as(self.number(key), float(value), key)
        for key in self._seeds:
            yield key, int(seed)

    def _has(self, key: str) -> bool:
        try:
            self.number(key)
        except ScenarioError:
            return False
        return True


def _as(like: float | int, value: float, key: str) -> float | int:
    """Return a value as a whole number where the key holds one; numbers of shapes may be written so, but are none."""
    if isinstance(like, float) or key.startswith("goal.") or ".shape." in key:
        return value
    if not (math.isfinite(value) and value == round(value)):
        raise ScenarioError(f"{key} is {value}, expected a whole number")
    return round(value)


def _copy(value: Any) -> Any:
    """Return a table of its own, with lists for what a scenario keeps as tuples."""
    if isinstance(value, dict):
        return {key: _copy(item) for key, item in value.items()}
    return [_copy(item) for item in value] if isinstance(value, list | tuple) else value
