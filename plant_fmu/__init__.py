"""Underwater vehicles as FMI co-simulation units: vehicle files in, FMU files out."""

from plant_fmu.build import build_fmu, cached_fmu
from plant_fmu.errors import BuildError, FmuFileError, PlantFmuError, TableError, VehicleError
from plant_fmu.vehicle import Vehicle, load_vehicle, shipped_vehicles

__all__ = [
    "BuildError",
    "FmuFileError",
    "PlantFmuError",
    "TableError",
    "Vehicle",
    "VehicleError",
    "build_fmu",
    "cached_fmu",
    "load_vehicle",
    "shipped_vehicles",
]
