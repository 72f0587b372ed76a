"""Files of an identification: the vehicle with provenance and intervals as comments, and drawn vehicles."""

from __future__ import annotations

import itertools
import json
import re
import textwrap
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.errors import IdentificationError
from cosim.identification.fit import Fit
from cosim.identification.parameters import with_values
from cosim.scenario.toml_text import scenario_text
from plant_fmu.toml_tables import read_toml
from plant_fmu.vehicle import Vehicle, complete_tables, shipped_vehicles

DRAWS = 256  # number of drawn vehicles
_MAX_TRIALS = 100  # draws per vehicle, until its mass matrix is positive definite
_WIDTH = 118  # maximum length of a comment
_ATTRIBUTES = {
    "rigid_body.center_of_gravity": "r_G", "hydrostatics.center_of_buoyancy": "r_B",
    "thrusters.delay": "command_delay", "thrusters.matrix": "thruster_matrix",
    "thrusters.time_constant": "thrust_time_constant",
}  # fmt: skip


def vehicle_text(start: str, vehicle: Vehicle, fit: Fit, name: str, provenance: Sequence[str]) -> str:
    """Return the text of the identified vehicle's file."""
    identified = with_values(vehicle, fit.parameters, fit.values)
    tables = _start_tables(start)
    tables["name"], tables["title"] = name, f"{tables['title']}, identified"
    tables["source"] = (
        f"Identified from runs, see the comments; what was not free is that of {vehicle.name}: " + vehicle.source
    )
    delays = [p for p in fit.parameters if p.kind == "delay" and p.is_nuisance]
    for key in (*fit.free_keys(), *(("thrusters.delay",) if delays else ())):
        table, _, entry = key.partition(".")
        tables[table] = tables.get(table, {}) | {entry: _entry(key, identified)}
    if identified.sensor_delay:
        tables["sensors"] = tables.get("sensors", {}) | {"delay": dict(identified.sensor_delay)}
    lines = [*(f"# {line}" for sentence in provenance for line in textwrap.wrap(sentence, _WIDTH)), ""]
    table = ""
    for line in scenario_text(tables, {}).splitlines():
        table = f"{line[1:-1]}." if line.startswith("[") else table
        comment = _comment(table + line.partition(" = ")[0], fit)
        lines += [*(f"# {part}" for part in textwrap.wrap(comment, _WIDTH)), line]
    return "\n".join(lines) + "\n"


def name_of_file(out: Path) -> str:
    """Return the vehicle name that belongs to a file's name; raise IdentificationError if there is none."""
    name = re.sub(r"\W", "_", out.stem, flags=re.ASCII)[:64]
    if out.suffix != ".toml" or not name or name[0].isdigit():
        raise IdentificationError(
            f"--out {out}: is no vehicle's file, expected a name that ends in .toml and begins with a letter"
        )
    return name


def _start_tables(start: str) -> dict[str, Any]:
    if start not in shipped_vehicles():
        return complete_tables(read_toml(Path(start)))
    with resources.as_file(resources.files("plant_fmu") / "vehicles" / f"{start}.toml") as file:
        return read_toml(file)


def _entry(key: str, vehicle: Vehicle) -> Any:
    """Return the value of a key in the vehicle's file; a diagonal matrix as its diagonal."""
    value = np.asarray(getattr(vehicle, _ATTRIBUTES.get(key, key.partition(".")[2])))
    if key == "thrusters.time_constant":
        return float(value[0])
    is_square = value.ndim == 2 and value.shape[0] == value.shape[1] and key != "thrusters.matrix"
    if is_square and not np.any(value - np.diag(np.diag(value))):
        value = np.diag(value)
    return value.tolist()


def _comment(key: str, fit: Fit) -> str:
    """Return values, half widths of 95 % intervals and units of the parameters of a key; empty for other keys."""
    texts = []
    for i in fit.vehicle_indices():
        p = fit.parameters[i]
        if p.name != key and not p.name.startswith(f"{key}."):
            continue
        index = p.name.removeprefix(key).lstrip(".").replace(".", ",")
        basis = ", rests on its prior" if i in fit.undetermined() else ""
        number = f"{fit.values[i]:.4g} ± {fit.intervals.half[i]:.2g} {p.unit}".rstrip()
        texts.append((f"({index}) " if index else "") + number + basis)
    return "; ".join(texts)


def posterior_lines(fit: Fit, vehicle: Vehicle) -> list[str]:
    """Draw vehicles from an identification that began at `vehicle`; return a line of JSON for each."""
    return [json.dumps({"draw": i, "parameters": p}) for i, p in enumerate(draw_plants(fit, vehicle, seed=0))]


def draw_plants(fit: Fit, vehicle: Vehicle, seed: int, count: int = DRAWS) -> list[dict[str, float]]:
    """Draw parameters of the FMU from the normal distribution of the identified parameters."""
    indices = fit.vehicle_indices()
    parameters = [fit.parameters[i] for i in indices]
    low, high = (np.array([getattr(p, name) for p in parameters]) for name in ("min", "max"))
    covariance = fit.intervals.covariance[np.ix_(indices, indices)]
    rng = np.random.default_rng([seed, 28])
    plants: list[dict[str, float]] = []
    blocks = (rng.multivariate_normal(fit.values[indices], covariance, count) for _ in range(_MAX_TRIALS))
    for drawn in itertools.chain.from_iterable(blocks):
        values = np.clip(drawn, low, high)
        body = with_values(vehicle, parameters, values)
        if np.linalg.eigvalsh(body.mass_matrix)[0] <= 0.0:
            continue
        plants.append(_plant_parameters(fit, indices, values, body))
        if len(plants) == count:
            return plants
    raise IdentificationError("hardly any vehicle within the intervals has a positive definite mass matrix")


def _plant_parameters(fit: Fit, indices: Sequence[int], values: NDArray[np.float64], body: Vehicle) -> dict[str, float]:
    """Return the parameters of the FMU that values of the vehicle's parameters set."""
    plant: dict[str, float] = {}
    for i, value in zip(indices, values.tolist(), strict=True):
        p = fit.parameters[i]
        if p.kind == "lag":
            plant |= {f"thrust_time_constant[{n + 1}]": value for n in range(body.n_thrusters)}
        elif p.kind == "thrust":
            column = body.thruster_matrix[:, p.index]
            plant |= {f"thruster_matrix[{k + 1},{p.index + 1}]": float(column[k]) for k in np.flatnonzero(column)}
        elif p.plant:
            plant[p.plant] = value
    return plant
