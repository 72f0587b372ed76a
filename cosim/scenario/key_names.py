"""Names of a scenario's keys in words, with their units, for tables and figures."""

from __future__ import annotations

from typing import Any, NamedTuple

from cosim.scenario.criteria import QUANTITIES
from cosim.scenario.keys import KEYS, unit_of_gain, unit_of_shape
from cosim.scenario.toml_file import current_key
from plant_fmu.variables import variables
from plant_fmu.vehicle import Vehicle

PARAMETERS = "plant.parameters."

_WORDS = {  # names of keys whose parts make no clear name
    "time.duration": "duration",
    "time.step": "time step",
    "time.control": "control period",
    "time.arbiter": "arbiter period",
    "plant.substep": "integration step",
    "plant.current": "current",
    "initial.position": "start position",
    "initial.quaternion": "start attitude, quaternion",
    "initial.velocity": "start velocity",
    "law.desired_quaternion": "desired attitude, quaternion",
    "arbiter.ramp": "ramp of memberships",
    "arbiter.points": "points of the arbiter's output",
    "limit.force": "force limit",
    "limit.time_constant": "lag of the force",
    "sensing.position_noise": "position noise",
    "sensing.velocity_noise": "velocity noise",
    "sensing.seed": "seed of the noise",
    "sensing.dead_from": "measurements lost from",
    "sensing.dead_for": "measurements lost for",
    "commands.obstacle_radius": "radius of obstacles that come in",
    "commands.obstacle_gain": "gain of obstacles that come in",
    "commands.hold_radius": "radius held in",
    "commands.surface_depth": "depth when surfaced",
}
_AXES = {3: "xyz", 4: "wxyz", 6: "uvwpqr"}  # names of a vector's elements, by its length


class KeyName(NamedTuple):
    """Name of a key in words, and its unit."""

    words: str
    unit: str  # unit; "" for a pure number, or if it is not known

    @property
    def label(self) -> str:
        """The words, with the unit in brackets."""
        return f"{self.words} [{self.unit}]" if self.unit else self.words


def key_name(key: str, table: dict[str, Any], vehicle: Vehicle) -> KeyName:
    """Return the name of a scenario's key."""
    if key.startswith(PARAMETERS):
        name = key.removeprefix(PARAMETERS)
        units = (v.quantity.unit for v in variables(vehicle) if v.name == name)
        return KeyName(f"{name} of the plant", next(units, "").replace(".", " "))
    key = current_key(table, key)
    if key.startswith("law.gains."):
        gain = key.removeprefix("law.gains.")
        return KeyName(f"gain {gain}", unit_of_gain(table["law"]["name"], gain))
    head, *rest = key.split(".")
    if head == "regions" and len(rest) > 1:
        regions = table["regions"]
        item = next((r for r in regions if r["name"] == rest[0]), None) or regions[int(rest[0])]
        return _region_key_name(item["name"], item, rest[1:])
    if head == "goal" and rest:
        if rest[0] == "then" and len(rest) > 2 and not rest[2].isdecimal():
            entry, name = table["goal"]["then"][int(rest[1])], f"the goal's next place {rest[1]}"
            return _region_key_name(name, entry, rest[2:], "goal.then[]")
        own = f"goal.{rest[0]}" in KEYS
        return _region_key_name("the goal", table["goal"] | {"shape": table["goal"]}, rest if own else ["shape", *rest])
    if head == "components" and len(rest) > 1 and f"components[].{rest[1]}" in KEYS:
        unit = KEYS[f"components[].{rest[1]}"].unit
        return KeyName(f"{'.'.join(rest[2:]) or rest[1]} of {rest[0]}", unit)
    if head in ("failures", "outages") and len(rest) == 2:
        return KeyName(f"{rest[1]} of {head[:-1]} {rest[0]}", KEYS[f"{head}[].{rest[1]}"].unit)
    if head == "criteria" and len(rest) > 1:
        criteria = table["criteria"]
        item = next((c for c in criteria if c["name"] == rest[0]), None) or criteria[int(rest[0])]
        unit = QUANTITIES.get(rest[2], "").partition(",")[0] if rest[1] == "membership" and len(rest) > 2 else ""
        return KeyName(f"{' '.join(rest[1:]).replace('_', ' ')} of {item['name']}", unit)
    if key not in KEYS and (vector := key.rpartition(".")[0]) in _WORDS:
        index, count = int(rest[-1]), len(table[head][rest[0]])
        linear, _, angular = KEYS[vector].unit.partition(", ")
        return KeyName(f"{_WORDS[vector]} {_AXES[count][index]}", angular if angular and index >= 3 else linear)
    unit = KEYS[key].unit if key in KEYS else ""
    return KeyName(_WORDS.get(key, key.replace(".", " ").replace("_", " ")), unit)


def _region_key_name(name: str, region: dict[str, Any], path: list[str], table: str = "regions[]") -> KeyName:
    """Return the name of a key of a region, of its shape, or of another table."""
    if path[0] == "shape" and len(path) > 1:
        _, key, *indices = path
        value, unit = region["shape"].get(key), unit_of_shape(region["shape"]["type"], key)
    else:
        key, *indices = path
        of = KEYS.get(f"{table}.{key}") or KEYS[f"goal.{key}"]
        value, unit = region.get(key), of.unit
    words = key.replace("_", " ")
    if len(indices) == 2 or key == "rings":  # of several
        words, value, indices = (
            f"{words.removesuffix('s')} {indices[0]}" if indices else words,
            value[int(indices[0])] if indices else value,
            indices[1:],
        )
    if indices:
        words += f" {_AXES.get(len(value), 'xy')[int(indices[0])]}"
    return KeyName(f"{words} of {name}", unit)
