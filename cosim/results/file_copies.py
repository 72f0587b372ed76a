"""The files that repeat a scenario: its own, and copies of those that it names."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cosim.errors import RunError
from cosim.scenario.fmu_tables import UserFmu
from cosim.scenario.scenario import Scenario
from cosim.scenario.toml_text import scenario_text

VEHICLE_COPY = "vehicle.toml"  # name in a run folder of a vehicle that is not shipped


def table_of_files(scenario: Scenario) -> dict[str, Any]:
    """Return the table of a scenario, with the names of the copies in `files_of`."""
    table, names = scenario.table, _names_of_copies(scenario)
    changed: dict[str, Any] = {"vehicle": VEHICLE_COPY} if scenario.vehicle_file else {}
    tables = {"law": scenario.law.fmu, "plant": scenario.plant_fmu}
    changed |= {key: table[key] | {"file": names[fmu.file]} for key, fmu in tables.items() if fmu}
    changed["goal"] = _with_copy(table["goal"], names)
    changed["regions"] = tuple(region | {"shape": _with_copy(region["shape"], names)} for region in table["regions"])
    changed["components"] = tuple(_with_copy(entry, names) for entry in table["components"])
    return table | changed


def _with_copy(entry: dict[str, Any], names: dict[Path, str]) -> dict[str, Any]:
    """Return the table of a shape or an FMU with the name of the copy of its file."""
    return entry | {"file": names[Path(entry["file"])]} if "file" in entry else entry


def files_of(scenario: Scenario) -> dict[str, bytes]:
    """Return the files that repeat a scenario, by name: its own, and copies of those that it names."""
    sources = {name: file for file, name in _names_of_copies(scenario).items()}
    sources |= {VEHICLE_COPY: scenario.vehicle_file} if scenario.vehicle_file else {}
    try:
        copies = {name: source.read_bytes() for name, source in sources.items()}
    except OSError as error:
        raise RunError(f"{error.filename}: {error.strerror or error}") from error
    return {"scenario.toml": scenario_text(table_of_files(scenario), {}).encode()} | copies


def fmus_of(scenario: Scenario) -> list[UserFmu]:
    """Return the FMUs of the user's that a scenario names: law, plant, components."""
    return [fmu for fmu in (scenario.law.fmu, scenario.plant_fmu, *scenario.components) if fmu]


def _names_of_copies(scenario: Scenario) -> dict[Path, str]:
    """Return the names of the copies of FMUs and shapes, which differ, by file."""
    shapes = [scenario.goal, *(secondary.region.shape for secondary in scenario.regions)]
    files = [fmu.file for fmu in fmus_of(scenario)]
    files += [Path(shape.file) for shape in shapes if hasattr(shape, "file")]
    taken, names = {"scenario.toml", VEHICLE_COPY}, dict[Path, str]()
    for file in dict.fromkeys(files):
        choices = (file.name, *(f"{file.stem}-{i}{file.suffix}" for i in range(2, len(files) + 3)))
        names[file] = next(name for name in choices if name not in taken)
        taken.add(names[file])
    return names
