"""The numbers of a scenario that a page may change, and where the WebAssembly of its flight keeps them."""

# Only keys whose numbers the flight uses as they are, and positions, are offered.

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from controller.regions.region_set import shape_entry
from controller.regions.shape import Shape
from controller.regions.shapes.visibility import Visibility
from cosim.replay.interactive.flight import Flight
from cosim.scenario.changes import value_at
from cosim.scenario.key_names import PARAMETERS, key_name
from cosim.ssp.memory import Memory

BUOYANCY = f"{PARAMETERS}buoyancy"
_STARTS = {**{f"plant.current.{i}": f"current.{axis}" for i, axis in enumerate("xyz")}, BUOYANCY: "buoyancy"}
_NOISE = ("sensing.position_noise", "sensing.velocity_noise")
_AXES = {"x": 0, "y": 1, "z": 2, "north": 0, "east": 1}
_POINTS = ("center", "feature", "point", "middle", "corner", "position")  # packed numbers that are a position
_DEPTHS = ("top", "bottom", "depth")  # packed numbers that are a depth

Axes = tuple[tuple[str, ...], ...]  # keys that move a region along each axis


@dataclass(frozen=True)
class Slot:
    """A number that a page may change."""

    key: str  # key of the scenario, as in ``--set``
    words: str  # description for the page
    unit: str  # unit of `value`
    value: float  # value in the scenario
    # where the number goes: ``numbers`` or ``gains`` of the module, ``starts`` of the plant, or ``noise``; ``middle``
    # of a cylinder's two ends, or ``moved`` with all that belongs to it, which are ``numbers`` that the page computes
    target: str
    offsets: tuple[int, ...]  # indices there, or value references of the plant
    numbers: tuple[float, ...] = ()  # of ``moved``: numbers there in the scenario


def find_slots(flight: Flight, memory: Memory) -> tuple[list[Slot], list[Axes | None]]:
    """Return the numbers that a page may change, and for each region the keys that move it; None if none do."""
    scenario, data, model = flight.scenario, flight.data, flight.model
    targets: dict[str, tuple[Any, ...]] = {key: ("starts", (flight.reference(name),)) for key, name in _STARTS.items()}
    if flight.noise.size:
        targets |= {key: ("noise", (i,)) for i, key in enumerate(_NOISE)}
    gains = scenario.law.gains
    # a law computes nothing from its gains before its steps
    targets |= {f"law.gains.{gain}": ("gains", (i,)) for i, gain in enumerate(gains._fields)}
    moves: list[Axes | None] = []
    has_center = shape_entry(scenario.goal).center is not None
    shapes = [("goal", scenario.goal, data.goal, 0)]
    shapes += [(f"regions.{i}.shape", r.region.shape, data.regions, i) for i, r in enumerate(scenario.regions)]
    for path, shape, packed, i in shapes:
        positions, first = list(_positions(path, shape)), memory.keep(packed.numbers) + int(packed.offsets[i])
        if scenario.mission.uses_features and isinstance(shape, Visibility):
            positions = []  # the mission looks at its feature, or moves it
        # of a goal without a point for its center, the page does not know the shifts to its next positions
        if not positions or (path == "goal" and scenario.goal_then and not has_center):
            moves.append(None)
            continue
        moves.append(tuple(tuple(key for _, a, keys in positions if a == axis for key in keys) for axis in range(3)))
        for index, axis, keys in positions:
            centers = (model.goal_center, data.goal_center) if path == "goal" and has_center else ()
            offsets = first + index, *(memory.keep(center) + axis for center in centers)
            targets |= dict.fromkeys(keys, ("numbers" if len(keys) == 1 else "middle", offsets))
    if has_center:
        targets |= _places(flight, memory)
    slots = []
    for key, target in targets.items():
        name, value = key_name(key, scenario.table, scenario.vehicle), value_at(scenario.table, key, scenario.vehicle)
        slots.append(Slot(key, name.words, name.unit, float(value), *target))
    return slots, moves


def _places(flight: Flight, memory: Memory) -> dict[str, tuple[str, tuple[int, ...], tuple[float, ...]]]:
    """Return where the keys go that move the goal's next places, each with all centers and features that move along."""
    scenario, model, targets = flight.scenario, flight.model.mission, {}
    for key in dict.fromkeys(scenario.mission.keys[1:]):
        north = f"{key}.0"
        shifted = scenario.replace({north: float(value_at(scenario.table, north, scenario.vehicle)) + 1.0}).mission
        for axis in range(3):
            offsets, numbers = [], []
            for array, field in ((model.centers, "center"), (model.features, "feature")):
                for i, (leg, other) in enumerate(zip(scenario.mission.legs, shifted.legs, strict=True)):
                    if getattr(other, field)[0] - getattr(leg, field)[0] > 0.5:
                        offsets.append(memory.keep(array) + 3 * i + axis)
                        numbers.append(float(array[i, axis]))
            targets[f"{key}.{axis}"] = "moved", tuple(offsets), tuple(numbers)
    return targets


def _positions(path: str, shape: Shape) -> Iterator[tuple[int, int, tuple[str, ...]]]:
    """Yield index and axis of each packed number of a shape that is a position, with the keys that move it."""
    for index, number in enumerate(shape.numbers()):
        vector, _, axis = number.name.partition(".")
        name, _, nth = vector.rstrip("]").partition("[")
        if name in _DEPTHS:
            yield index, 2, (f"{path}.{name}",)
        elif name == "middle":
            yield index, _AXES[axis], tuple(f"{path}.{end}.{_AXES[axis]}" for end in ("start", "end"))
        elif name in _POINTS and not nth:
            yield index, _AXES[axis], (f"{path}.{name}.{_AXES[axis]}",)
        elif name in _POINTS:
            vectors = getattr(shape, f"{name}s")
            in_order = shape.packed()[-len(vectors[-1]) :] == tuple(vectors[-1])  # a prism may pack them in reverse
            item = int(nth) - 1 if in_order else len(vectors) - int(nth)
            yield index, _AXES[axis], (f"{path}.{name}s.{item}.{_AXES[axis]}",)
