"""Lines of action of thrusters, derived from their wrenches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plant_fmu.vehicle import Vehicle


@dataclass(frozen=True, eq=False)
class ThrusterLine:
    """The line of action of a thruster; a wrench does not determine the thruster's place along it."""

    force: NDArray[np.float64]  # (3,) force for one newton, body frame; 0 for a thruster that only turns the body
    nearest: NDArray[np.float64]  # (3,) m, body frame: the line's point nearest to the body origin


def thruster_lines(vehicle: Vehicle) -> list[ThrusterLine]:
    """Return the line of action of each thruster."""
    lines = []
    for column in vehicle.thruster_matrix.T:
        force, moment = column[:3].copy(), column[3:]
        square = float(force @ force)
        lines.append(ThrusterLine(force, np.cross(force, moment) / square if square > 0.0 else np.zeros(3)))
    return lines
