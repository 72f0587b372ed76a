"""Which numbers of a scenario vary, and the scenario that any choice of them makes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

from controller import ControllerError
from cosim.errors import ScenarioError
from cosim.scenario import Scenario, checked_scenario
from cosim.scenario_check import known_parameters
from plant_fmu.errors import PlantFmuError
from plant_fmu.tables import hint

_PARAMETERS = "plant.parameters."
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
        if key.startswith(_PARAMETERS):
            name, known = key.removeprefix(_PARAMETERS), known_parameters(self.base.vehicle)
            if name not in known:
                raise ScenarioError(f"key {key!r} is no parameter of the vehicle's FMU; {hint(name, known)}")
            return self.base.plant.parameters.get(name, known[name])
        at, last = _place(self.base.table, key)
        return at[last]

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
        for key, value in self._changes(values, seed):
            if key.startswith(_PARAMETERS):
                table["plant"]["parameters"][key.removeprefix(_PARAMETERS)] = value
            else:
                at, last = _place(table, key)
                at[last] = value
        try:
            return checked_scenario(table, self.base.name, self.base.vehicle)
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


def _place(table: dict[str, Any], key: str) -> tuple[Any, Any]:
    """Return the table or list that holds a key, and the key's place in it."""
    *path, last = key.split(".")
    at: Any = table
    for depth, part in enumerate([*path, last]):
        if isinstance(at, list | tuple):
            names = [item.get("name") for item in at if isinstance(item, dict)]
            inside = part.isdecimal() and int(part) < len(at)
            place: Any = names.index(part) if part in names else int(part) if inside else None
            known = names or list(map(str, range(len(at))))
        else:
            known = list(at) if isinstance(at, dict) else []
            place = part if part in known else None
        if place is None:
            where = ".".join(key.split(".")[:depth])
            said = hint(part, map(str, known)) if known else f"{where} holds no others"
            what = "is unknown" if part == key else f"is unknown: {part!r}"
            raise ScenarioError(f"key {key!r} {what}; {said}")
        if depth == len(path):
            return at, place
        at = at[place]
    raise AssertionError("unreachable")
