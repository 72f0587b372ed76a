"""Draft of a column map, guessed from the names of columns or fields."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from cosim.errors import ImportLogError

# quantities with the names of their columns, as regular expressions that match the whole last part of a name
_GUESSES: tuple[tuple[str, tuple[str, ...], dict[str, str]], ...] = (
    ("attitude", tuple(f"q_?{a}|(.*orientation|rotation|quaternion).?{a}|.*e{i}" for i, a in enumerate("wxyz")), {}),
    ("attitude", ("yaw|heading|psi", "pitch|theta", "roll|phi"), {"euler": "ZYX"}),
    ("wrench", ("F_?x|X|.*force.x|tau_?x|surge", "F_?y|Y|.*force.y|tau_?y|sway", "F_?z|Z|.*force.z|tau_?z|heave",
                "[MT]_?x|K|.*torque.x", "[MT]_?y|M|.*torque.y", "[MT]_?z|N|.*torque.z"), {}),
    ("dvl", ("u|v_?x|vel_?x|velocity_?x|.*linear.x|.*velocity.x", "v|v_?y|vel_?y|velocity_?y|.*linear.y|.*velocity.y",
             "w|v_?z|vel_?z|velocity_?z|.*linear.z|.*velocity.z"), {}),
    ("rates", ("p|w_?x|gyro_?x|.*angular(_velocity)?.x|rollspeed", "q|w_?y|gyro_?y|.*angular(_velocity)?.y|pitchspeed",
               "r|w_?z|gyro_?z|.*angular(_velocity)?.z|yawspeed"), {}),
    ("position", ("x|north|pos_?x|.*position.x", "y|east|pos_?y|.*position.y", "z|down|pos_?z|.*position.z"), {}),
    ("depth", ("depth|depth_m|z|down",), {}),
    ("altitude", ("altitude|alt|height|range",), {}),
    ("acceleration", ("a_?x|acc_?x|.*linear_acceleration.x", "a_?y|acc_?y|.*linear_acceleration.y",
                      "a_?z|acc_?z|.*linear_acceleration.z"), {}),
    ("voltage", ("volt.*|battery.*",), {}),
)  # fmt: skip
_THRUSTERS = (
    ("pulses", r"(pwm|servo|ch|chan|rcou|rc|c)_?\d+(_raw)?"),
    ("thrust", r"(thrust|thruster|force|f|t)[_\[]?\d+\]?"),
)
_TIME = re.compile(r"t|time.*|.*stamp.*|sec(onds)?|.*_time|date.*", re.IGNORECASE)
_UNIT = re.compile(r"[\s_]*[\[(]?(rad/s|deg/s|m/s|cm/s|rad|deg|ms|us|ns|s|m|cm|mm|N|V)[\])]?$")


def missing_map(topics: Mapping[str, Mapping[str, float]]) -> ImportLogError:
    """Return the error of a log without a map, with a draft that fits the columns of its topics and their rates."""
    error = ImportLogError("needs a column map, expected --map FILE: it says which column is what")
    error.draft = "".join(f"{line}\n" for line in _draft(topics))
    return error


def _draft(topics: Mapping[str, Mapping[str, float]]) -> Iterator[str]:
    yield "# Draft of a column map, guessed from names: check units, signs and frames, and remove what is wrong."
    unit = "of the rows have a new value" if "" in topics else "messages per second"
    for topic, columns in topics.items():
        listed = ", ".join(f"{name} {100 * x:.0f} %" if not topic else name for name, x in columns.items())
        rate = f" ({next(iter(columns.values()), 0.0):.3g} {unit})" if topic else f" ({unit})"
        yield f"# {topic or 'columns'}{rate}: {listed or 'no numbers'}"
    yield 'world = "NED"  # or ENU, NWU'
    yield 'body = "FRD"   # or FLU, RFU'
    table = topics.get("", {})
    times = [name for name in table if _TIME.fullmatch(name)]
    if times:
        unit = next((u for u in ("ms", "us", "ns") if re.search(rf"[_\[( ]{u}\b", times[0])), "s")
        yield f'time = {{ column = "{times[0]}", unit = "{unit}" }}'
    seen = set[str]()
    for topic, columns in topics.items():
        for name, entry in _quantities([c for c in columns if c not in times]):
            if name not in seen:
                seen.add(name)
                yield f"\n[{name}]"
                yield from (f"{key} = {json.dumps(value)}" for key, value in entry.items())
                yield from [f"topic = {json.dumps(topic)}"] if topic else []


def _quantities(columns: Sequence[str]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the quantities that names of columns suggest, with their tables."""
    left = list(columns)
    for name, patterns, extra in _GUESSES:
        matches = [next((c for c in left if _matches(c, pattern)), "") for pattern in patterns]
        if all(matches) and len(set(matches)) == len(matches):
            left = [c for c in left if c not in matches]
            match = _UNIT.search(matches[0])
            known = {"unit": match[1]} if match and match[1] in ("deg", "deg/s", "cm", "mm", "cm/s") else {}
            yield name, {"columns": matches} | extra | known
    for name, pattern in _THRUSTERS:
        matches = [c for c in left if re.fullmatch(pattern, c, re.IGNORECASE)]
        if len(matches) > 1:
            yield name, {"columns": matches}


def _matches(column: str, pattern: str) -> bool:
    """Return True if a name, without its unit, matches; single letters are compared with their case."""
    plain = _UNIT.sub("", column) or column
    is_letter = len(plain) == 1
    return re.fullmatch(pattern, plain, 0 if is_letter else re.IGNORECASE) is not None
