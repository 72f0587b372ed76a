"""Names and ranges of the packed numbers of a shape in an FMU."""

from __future__ import annotations

from controller.regions.shape import Shape
from plant_fmu.quantities import Quantity


def shape_numbers(shape: Shape) -> tuple[tuple[str, Quantity], ...]:
    """Return name and quantity of each number that a shape packs."""
    return tuple((name, Quantity(unit, least, greatest)) for name, unit, least, greatest, _ in shape.numbers())
