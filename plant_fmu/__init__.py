"""Underwater vehicles as FMI co-simulation units: vehicle files in, FMU files out, and a plant that steps them."""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from plant_fmu.build import build_fmu, cached_fmu
    from plant_fmu.errors import BuildError, FmuFileError, PlantError, PlantFmuError, TableError, VehicleError
    from plant_fmu.running import Channel, Channels, Plant, State
    from plant_fmu.vehicle import Vehicle, load_vehicle, shipped_vehicles

__all__ = [
    "BuildError",
    "Channel",
    "Channels",
    "FmuFileError",
    "Plant",
    "PlantError",
    "PlantFmuError",
    "State",
    "TableError",
    "Vehicle",
    "VehicleError",
    "build_fmu",
    "cached_fmu",
    "load_vehicle",
    "shipped_vehicles",
]

# imported when asked for, so that the command can say what is not installed
_HOMES = {
    "build": {"build_fmu", "cached_fmu"},
    "running": {"Channel", "Channels", "Plant", "State"},
    "vehicle": {"Vehicle", "load_vehicle", "shipped_vehicles"},
}


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = next((home for home, names in _HOMES.items() if name in names), "errors")
    return getattr(importlib.import_module(f"{__name__}.{home}"), name)
