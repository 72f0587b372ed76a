"""File of the identified vehicle, with provenance and intervals as comments."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from cosim.errors import IdentificationError
from cosim.identification.fit import Fit
from cosim.identification.parameters import with_values
from plant_fmu.toml_tables import read_toml
from plant_fmu.vehicle import Vehicle, shipped_vehicles

_WIDTH = 118  # most characters of a comment's line


def vehicle_text(start: str, vehicle: Vehicle, fit: Fit, name: str, provenance: Sequence[str]) -> str:
    """Return the text of the identified vehicle's file."""
    found = with_values(vehicle, fit.parameters, fit.values)
    tables = _tables_of(start)
    tables["name"], tables["title"] = name, f"{tables['title']}, identified"
    tables["source"] = (
        f"Identified from runs, see the comments; what was not free is that of {vehicle.name}: " + vehicle.source
    )
    for key in _changed(fit):
        table, _, entry = key.partition(".")
        tables[table][entry] = _entry(key, found)
    lines = [*(f"# {line}" for sentence in provenance for line in _wrapped(sentence)), ""]
    lines += [f"{key} = {_value(value)}" for key, value in tables.items() if not isinstance(value, dict)]
    for key, value in tables.items():
        if isinstance(value, dict):
            lines += ["", f"[{key}]"]
            for entry, inside in value.items():
                lines += [f"# {line}" for line in _about(f"{key}.{entry}", fit)]
                lines.append(f"{entry} = {_value(inside)}")
    return "\n".join(lines) + "\n"


def name_of_file(out: Path) -> str:
    """Return the vehicle name that belongs to a file's name; raise IdentificationError if there is none."""
    name = re.sub(r"\W", "_", out.stem, flags=re.ASCII)[:64]
    if out.suffix != ".toml" or not name or name[0].isdigit():
        raise IdentificationError(
            f"--out {out}: is no vehicle's file, expected a name that ends in .toml and begins with a letter"
        )
    return name


def _tables_of(start: str) -> dict[str, Any]:
    if start not in shipped_vehicles():
        return read_toml(Path(start))
    with resources.as_file(resources.files("plant_fmu") / "vehicles" / f"{start}.toml") as file:
        return read_toml(file)


def _changed(fit: Fit) -> list[str]:
    """Return the keys of the file that the fit changes, each once."""
    keys = [".".join(fit.parameters[i].name.split(".")[:2]) for i in fit.vehicle_part()]
    return list(dict.fromkeys(keys))


def _entry(key: str, found: Vehicle) -> Any:
    names = {
        "rigid_body.center_of_gravity": "r_G", "hydrostatics.center_of_buoyancy": "r_B",
        "thrusters.matrix": "thruster_matrix", "thrusters.time_constant": "thrust_time_constant",
    }  # fmt: skip
    value = np.asarray(getattr(found, names.get(key, key.partition(".")[2])))
    if key == "thrusters.time_constant":
        return float(value[0])
    square = value.ndim == 2 and value.shape[0] == value.shape[1] and key != "thrusters.matrix"
    if square and not np.any(value - np.diag(np.diag(value))):
        value = np.diag(value)
    return value.tolist()


def _about(key: str, fit: Fit) -> Iterator[str]:
    """Yield comments on the numbers of a key: values, halves of their 95 % intervals, units."""
    words = []
    for i in fit.vehicle_part():
        p = fit.parameters[i]
        if p.name != key and not p.name.startswith(f"{key}."):
            continue
        place = p.name.removeprefix(key).lstrip(".")
        half = fit.intervals.half[i]
        at = f"({place.replace('.', ',')}) " if place else ""
        rests = ", rests on its prior" if i in fit.resting() else ""
        words.append(f"{at}{fit.values[i]:.4g} ± {half:.2g} {p.unit}".rstrip() + rests)
    if words:
        yield from _wrapped("; ".join(words))


def _wrapped(text: str) -> list[str]:
    lines = [""]
    for word in text.split():
        if lines[-1] and len(lines[-1]) + len(word) >= _WIDTH:
            lines.append("")
        lines[-1] += f" {word}" if lines[-1] else word
    return lines


def _value(value: Any) -> str:
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list):
        if value and isinstance(value[0], list):
            return "[\n" + "".join(f"    {_value(row)},\n" for row in value) + "]"
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_value(inside)}" for key, inside in value.items()) + " }"
    return repr(value)
