"""The numbers of a scenario that a page may change, and where the WebAssembly of its flight keeps them."""

# Only keys whose numbers the flight uses as they are, and positions, are offered.

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from controller.regions.region_set import shape_entry
from controller.regions.shape import Shape
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
    # of a cylinder's two ends, ``shift`` from the goal's center, which are ``numbers`` that the page computes
    target: str
    offsets: tuple[int, ...]  # indices there, or value references of the plant


def find_slots(flight: Flight, memory: Memory) -> tuple[list[Slot], list[Axes | None]]:
    """Return the numbers that a page may change, and for each region the keys that move it; None if none do."""
    scenario, data, model = flight.scenario, flight.data, flight.model
    targets: dict[str, tuple[str, tuple[int, ...]]] = {
        key: ("starts", (flight.reference(name),)) for key, name in _STARTS.items()
    }
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
        # of a goal without a point for its center, the page does not know the shifts to its next positions
        if not positions or (path == "goal" and scenario.goal_then and not has_center):
            moves.append(None)
            continue
        moves.append(tuple(tuple(key for _, a, keys in positions if a == axis for key in keys) for axis in range(3)))
        for index, axis, keys in positions:
            centers = (model.goal_center, data.goal_center) if path == "goal" and has_center else ()
            offsets = first + index, *(memory.keep(center) + axis for center in centers)
            targets |= dict.fromkeys(keys, ("numbers" if len(keys) == 1 else "middle", offsets))
    for i in range(model.goal_places.size):
        targets[f"goal.then.{i // 3}.{i % 3}"] = "shift", (memory.keep(model.goal_places) + i,)
    slots = []
    for key, target in targets.items():
        name, value = key_name(key, scenario.table, scenario.vehicle), value_at(scenario.table, key, scenario.vehicle)
        slots.append(Slot(key, name.words, name.unit, float(value), *target))
    return slots, moves


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
