"""Underwater vehicles as FMI co-simulation units: vehicle files in, FMU files out, and a plant that steps them."""

import importlib
import warnings
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from plant_fmu.build import build_fmu
    from plant_fmu.errors import PlantError, PlantFmuError
    from plant_fmu.running import Plant
    from plant_fmu.vehicle import Vehicle, load_vehicle

__all__ = ["Plant", "PlantError", "PlantFmuError", "Vehicle", "build_fmu", "load_vehicle"]

# imported on first use, so that the command can report a dependency that is not installed
_HOMES = {"build": {"build_fmu"}, "running": {"Plant"}, "vehicle": {"Vehicle", "load_vehicle", "shipped_vehicles"}}


def __getattr__(name: str) -> object:
    if name == "shipped_vehicles":
        message = "plant_fmu.shipped_vehicles is no longer public, but in plant_fmu.vehicle"
        warnings.warn(message, DeprecationWarning, stacklevel=2)
    elif name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = next((home for home, names in _HOMES.items() if name in names), "errors")
    return getattr(importlib.import_module(f"{__name__}.{home}"), name)
