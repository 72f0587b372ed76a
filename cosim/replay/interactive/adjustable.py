"""The numbers of a scenario that a page may change, and where the WebAssembly of its flight keeps them."""

# Each key is tried: the arrays in which its new number appears unchanged are those that hold it. A key whose
# number is only used to compute others is not offered: the page writes numbers, and computes none from them.

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controller import ControllerError
from controller.regions.region_set import shape_entry
from cosim.errors import ScenarioError
from cosim.replay.interactive.flight import Flight
from cosim.scenario.changes import value_at, with_values
from cosim.scenario.key_names import PARAMETERS, key_name
from cosim.scenario.scenario import Scenario, validate_scenario
from cosim.ssp.memory import Memory
from plant_fmu import PlantFmuError
from plant_fmu.variables import variables

CURRENT = tuple(f"plant.current.{axis}" for axis in range(3))
BUOYANCY = f"{PARAMETERS}buoyancy"
NOISE = ("sensing.position_noise", "sensing.velocity_noise")
# keys of shapes that hold a position, a list of positions, or a depth
_POINTS = ("center", "feature", "point", "start", "end")
_LISTS = ("points", "corners")
_DEPTHS = ("top", "bottom", "depth")
# tried numbers differ from the scenario's by the first, and these differences from each other by the second
_STEP, _APART = 0.0037291, 1.7e-5
# m, by which both ends of a cylinder are moved together along each axis: these keep its length to the last bit
_TOGETHER = (2.0**-8, 2.0**-9, 2.0**-10)


@dataclass(frozen=True)
class Slot:
    """A number that a page may change."""

    key: str  # key of the scenario, as in ``--set``
    words: str  # description and unit for the page
    unit: str  # description and unit for the page
    value: float  # value in the scenario
    # places: ``number`` or ``gain`` with a place in the module's arrays, ``start`` with a value reference of the
    # plant, ``noise`` with 0 or 1; ``middle`` with the place of the mean of a cylinder's two ends; ``shift`` with the
    # place of the difference to the goal's center
    places: tuple[tuple[str, int], ...]


def find_slots(flight: Flight, memory: Memory) -> tuple[list[Slot], list[tuple[tuple[str, ...], ...] | None]]:
    """Return the numbers that a page may change."""
    scenario, table = flight.scenario, flight.scenario.table
    noise = NOISE if flight.exact or (flight.noisy and not scenario.sensing.exact) else ()
    numbers = [*CURRENT, BUOYANCY, *noise, *(f"law.gains.{name}" for name in scenario.law.gains._fields)]
    shapes = [("goal", table["goal"]), *((f"regions.{i}.shape", r["shape"]) for i, r in enumerate(table["regions"]))]
    moving = [_moving_keys(path, shape) for path, shape in shapes]
    moving_keys = [key for axes in moving for keys in axes for key in keys]
    slots_of_keys = dict(_search(flight, memory, [*numbers, *moving_keys]))
    for path, shape in shapes:
        if {"start", "end"} <= shape.keys():
            slots_of_keys |= _ends_by_middle(flight, memory, path)
    then = [f"goal.then.{i}.{axis}" for i in range(len(scenario.goal_then)) for axis in range(3)]
    first = memory.keep(flight.setup.goal_places)
    slots_of_keys |= {key: (("shift", first + i),) for i, key in enumerate(then)}
    moves = [
        axes if any(axes) and all(key in slots_of_keys for keys in axes for key in keys) else None for axes in moving
    ]
    if then and shape_entry(scenario.goal).center is None:
        moves[0] = None  # the page does not know where its center would be
    offered = {key for axes in moves if axes for keys in axes for key in keys}.union(numbers, then)
    slots = []
    for key in (key for key in slots_of_keys if key in offered):
        name = key_name(key, table, scenario.vehicle)
        slots.append(Slot(key, name.words, name.unit, _value(scenario, key), slots_of_keys[key]))
    return slots, moves


def changed_scenario(scenario: Scenario, changes: Mapping[str, float]) -> Scenario:
    """Return a scenario with other numbers at some keys."""
    try:
        return validate_scenario(with_values(scenario.table, changes), scenario.name, scenario.vehicle)
    except (PlantFmuError, ControllerError) as error:
        raise ScenarioError(str(error)) from error


def _moving_keys(path: str, shape: dict[str, Any]) -> tuple[tuple[str, ...], ...]:
    axes: tuple[list[str], ...] = ([], [], [])
    for name, value in shape.items():
        if name in _POINTS and isinstance(value, list | tuple):
            vectors = [(f"{path}.{name}", value)]
        elif name in _LISTS:
            vectors = [(f"{path}.{name}.{i}", vector) for i, vector in enumerate(value)]
        elif name in _DEPTHS:
            axes[2].append(f"{path}.{name}")
            continue
        else:
            continue
        for at, vector in vectors:
            for axis in range(len(vector)):
                axes[axis].append(f"{at}.{axis}")
    return tuple(map(tuple, axes))


def _ends_by_middle(flight: Flight, memory: Memory, path: str) -> dict[str, tuple[tuple[str, int], ...]]:
    """Return both ends of an axis with the places of its middle, which alone changes when both move by the same."""
    ends = [(f"{path}.start.{axis}", f"{path}.end.{axis}") for axis in range(3)]
    changes = {key: _value(flight.scenario, key) + by for pair, by in zip(ends, _TOGETHER, strict=True) for key in pair}
    try:
        other = Flight(changed_scenario(flight.scenario, changes))
    except ScenarioError:
        return {}
    middles = {(changes[start] + changes[end]) / 2.0: start for start, end in ends}
    middle_slots = _places(flight, memory, other, middles) or {}
    if len(middle_slots) < len(ends):
        return {}
    return {key: tuple(("middle", place) for _, place in middle_slots[pair[0]]) for pair in ends for key in pair}


def _search(flight: Flight, memory: Memory, keys: Sequence[str]) -> Iterator[tuple[str, tuple[tuple[str, int], ...]]]:
    """Yield keys with the places of their numbers; many are tried at once, and fewer if their places are ambiguous."""
    for sign in (1.0, -1.0):
        changes = {key: _value(flight.scenario, key) + sign * (_STEP + _APART * i) for i, key in enumerate(keys)}
        try:
            other = Flight(changed_scenario(flight.scenario, changes))
        except ScenarioError:
            continue
        places = _places(flight, memory, other, {value: key for key, value in changes.items()})
        if places is not None and len(places) == len(keys):
            yield from ((key, tuple(dict.fromkeys(found))) for key, found in places.items())
            return
    if len(keys) > 1:
        half = len(keys) // 2
        yield from _search(flight, memory, keys[:half])
        yield from _search(flight, memory, keys[half:])


def _value(scenario: Scenario, key: str) -> float:
    return float(value_at(scenario.table, key, scenario.vehicle))


def _places(
    flight: Flight, memory: Memory, other: Flight, keys: Mapping[float, str]
) -> dict[str, list[tuple[str, int]]] | None:
    """Return the places of numbers in the flight, by comparison with one that has the numbers of `keys` there."""
    # None if anything else differs: then a changed number also enters a computation.
    slots: dict[str, list[tuple[str, int]]] = {}

    def put(value: float, kind: str, index: int) -> bool:
        if value in keys:
            slots.setdefault(keys[value], []).append((kind, index))
        return value in keys

    for array, changed in zip(flight.arrays(), other.arrays(), strict=True):
        if array is flight.setup.goal_places:  # the page computes these from the goal's keys
            continue
        if array.shape != changed.shape:
            return None
        differs = np.flatnonzero(~_equal(array, changed).ravel())
        if differs.size and (array.dtype != np.float64 or memory.is_named(array)):
            return None
        for i in differs.tolist():
            if not put(float(changed.ravel()[i]), "number", memory.keep(array) + i):
                return None
    for i, (one, new) in enumerate(zip(flight.law.gains, other.law.gains, strict=True)):
        if one != new and not put(new, "gain", i):
            return None
    references = {v.name: (i, v.type) for i, v in enumerate(variables(flight.scenario.vehicle))}
    for name, new in other.start.items():
        index, kind = references[name]
        if flight.start.get(name) != new and not (kind == "real" and put(new, "start", index)):
            return None
    for value, key in keys.items():
        if key in NOISE:
            put(value, "noise", NOISE.index(key))
    return slots if list(_numbers(flight.fly)) == list(_numbers(other.fly)) else None


def _numbers(value: Any) -> Iterator[Any]:
    """Yield the arguments of the loop that are not arrays."""
    if isinstance(value, tuple):
        for item in value:
            yield from _numbers(item)
    elif not isinstance(value, np.ndarray) and value == value:
        yield value


def _equal(one: np.ndarray, other: np.ndarray) -> NDArray[np.bool_]:
    same = np.asarray(one == other)
    return np.asarray(same | (np.isnan(one) & np.isnan(other))) if one.dtype == np.float64 else same
