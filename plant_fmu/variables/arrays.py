"""Variables as FMI 3.0 has them: arrays, and sensors on clocks; and the few that a small FMU shows."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import takewhile

from plant_fmu.quantities import FLAG, Quantity
from plant_fmu.variables.variable import SENSORS, Variable

_RATES = {"depth_sensor": 20.0, "dvl": 10.0, "imu": 100.0, "compass": 10.0, "usbl": 1.0}  # Hz, at the start
_HALVES = re.compile(r"(linear_damping|quadratic_damping|thruster_matrix)\[([1-6])(?:,(\d+))?\]")
_INDEXED = re.compile(r"(\w+(?:\.\w+)*)\[\d+\]")
_SMALL = re.compile(
    r"time|(position|quaternion|velocity|attitude|r_G|r_B|current)\..*|inertia\.(xx|yy|zz)"
    r"|(thrust|thruster_force|linear_damping|quadratic_damping)\[.*|mass|weight|buoyancy"
)


def show_small(rows: Sequence[Variable]) -> tuple[Variable, ...]:
    """Return the variables with all hidden but body and forces of thrusters."""
    return tuple(replace(v, hidden=_SMALL.fullmatch(v.name) is None) for v in rows)


def with_arrays(rows: Sequence[Variable], has_clocks: bool = True) -> tuple[Variable, ...]:
    """Return the variables with the elements of each array side by side, and with a clock for each sensor."""
    groups: dict[str, list[Variable]] = {}
    for v in rows:
        array = _array_name(v.name)
        groups.setdefault(array or v.name, []).append(replace(v, array=array))
    table = []
    for name, members in groups.items():
        for i, v in enumerate(members):
            shape: tuple[int, ...] = (0,) if i else (len(members),) if len(members) > 1 else ()
            if name.startswith("thruster_matrix.") and not i:
                shape = (3, len(members) // 3)
            start = _RATES[name.removesuffix(".rate")] if has_clocks and name.endswith(".rate") else v.start
            table.append(replace(v, shape=shape, start=start))
    return (*table, *(_clocks(table) if has_clocks else ()))


def _clocks(rows: Sequence[Variable]) -> Iterator[Variable]:
    for i, (sensor, what) in enumerate(SENSORS):
        names = tuple(v.name for v in rows if v.role == "parameter" and v.name.startswith(f"{sensor}."))
        description = f"Ticks when a sample of {what} is delivered"
        yield Variable(f"{sensor}.clock", "output", f"held.ticked[{i}]", FLAG, description,
                       depends=("time", *names), type="clock")  # fmt: skip


def _array_name(name: str) -> str:
    """Return the name of the array of which a scalar is an element; "" for none. All its elements have one unit."""
    if name.startswith("der("):
        inner = _array_name(name[4:-1])
        return inner and f"der({inner})"
    if match := _HALVES.fullmatch(name):
        return f"{match[1]}.{'force' if match[2] in '123' else 'moment'}"
    if match := _INDEXED.fullmatch(name):
        return match[1]
    stem, _, part = name.rpartition(".")
    if part in {*"xyz", *"uvw", "e0", "e1", "e2", "e3", "roll", "pitch", "yaw"}:
        return stem
    if part in {*"pqr"}:
        return stem if "angular_velocity" in stem else stem.replace("velocity", "angular_velocity")
    return f"{stem}.force" if part in {*"XYZ"} else f"{stem}.moment" if part in {*"KMN"} else ""


def described(rows: Sequence[Variable]) -> list[tuple[int, Variable]]:
    """Return the variables of the model description with their value references, an array as one."""
    shown = [(vr, v) for vr, v in enumerate(rows) if not v.hidden and v.size]
    return [(vr, _join(rows[vr : vr + v.size]) if v.size > 1 else v) for vr, v in shown]


def _join(elements: Sequence[Variable]) -> Variable:
    first, quantities = elements[0], [v.quantity for v in elements]
    minimum, maximum = min(q.minimum for q in quantities), max(q.maximum for q in quantities)
    is_rate = first.role == "derivative"
    return replace(
        first,
        name=first.array,
        description=f"Time derivative of {first.array[4:-1]}"
        if is_rate
        else _describe([v.description for v in elements]),
        quantity=Quantity(first.quantity.unit, minimum, maximum, max(q.nominal for q in quantities)),
        start=max((v.start for v in elements), key=abs),
        starts=tuple(v.start for v in elements),
        depends=tuple(dict.fromkeys(name for v in elements for name in v.depends)),
    )


def _describe(texts: Sequence[str]) -> str:
    """Return the descriptions of elements as one: what they have in common once, around what differs."""
    if len({*texts}) == 1:
        return texts[0]
    before = _common(texts)
    after = _common([text[len(before) :][::-1] for text in texts])[::-1]
    parts = [text.removeprefix(before).removesuffix(after) for text in texts]
    return before + (", ".join(parts) if len(parts) < 5 else f"{parts[0]} to {parts[-1]}") + after


def _common(texts: Sequence[str]) -> str:
    letters = zip(*texts, strict=False)
    return "".join(first for first, *_ in takewhile(lambda column: len({*column}) == 1, letters))
