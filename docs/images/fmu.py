"""Draws the pictures of docs/fmu.md into the folder in which it is run."""

from __future__ import annotations

from pathlib import Path

from small import write

from plant_fmu import load_vehicle
from plant_fmu.pictures import PICTURES

VEHICLE = "bluerov2_heavy"


def main() -> None:
    """Draw all of them; the comparison with the reference is drawn by examples/fmu_reference.py."""
    vehicle = load_vehicle(VEHICLE)
    for name, draw in PICTURES.items():
        write(draw(vehicle), Path(f"fmu-{name}.png"))
