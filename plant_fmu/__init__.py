"""Underwater vehicles as FMI co-simulation units: vehicle files in, FMU files out, and a plant that steps them."""

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
