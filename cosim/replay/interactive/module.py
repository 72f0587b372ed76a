"""The WebAssembly of a scenario's flight: compiled once, then kept in the user's cache."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import platformdirs

from controller.compiling.library import cache_library, has_valid_checksum
from cosim.replay.interactive.flight import Flight
from cosim.replay.interactive.flight_sources import flight_sources
from cosim.scenario.scenario import Scenario
from cosim.ssp.memory import Memory
from plant_fmu.archive import temporary_folder
from plant_fmu.compiling.compiler import FLAGS
from plant_fmu.compiling.libraries import digest
from plant_fmu.compiling.sources import c_sources, header
from plant_fmu.compiling.webassembly import module
from plant_fmu.description import token
from plant_fmu.vehicle_component import make_vehicle_component


@dataclass(frozen=True)
class FlightModule:
    """A flight with its WebAssembly, and the places of its arrays there."""

    flight: Flight
    memory: Memory
    binary: bytes


def flight_module(scenario: Scenario) -> FlightModule:
    """Return the WebAssembly of a scenario's flight."""
    flight, memory = Flight(scenario), Memory()
    component = make_vehicle_component(scenario.vehicle)
    key = token(component, 3)
    sources = flight_sources(flight, memory, key)
    made_from = {**c_sources(component, 3), component.header: header(component, key).encode(), **sources}
    name = f"{scenario.vehicle.name}-{digest(made_from, *FLAGS)[:32]}.wasm"
    kept = Path(platformdirs.user_cache_dir("subreach")) / "pages" / name
    if has_valid_checksum(kept):
        return FlightModule(flight, memory, kept.read_bytes())
    binary = module(component, key, sources)
    with temporary_folder("flight-") as scratch:
        built = scratch / name
        built.write_bytes(binary)
        cache_library(built, kept.parent)
    return FlightModule(flight, memory, binary)
