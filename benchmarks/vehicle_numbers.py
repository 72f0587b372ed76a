"""A vehicle's numbers as values for JSON, for peers that cannot read its file."""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_fmu import load_vehicle

_NAMES = (
    "mass", "r_G", "r_B", "inertia", "added_mass", "weight", "buoyancy", "linear_damping", "quadratic_damping",
    "thruster_matrix", "thrust_min", "thrust_max",
)  # fmt: skip


def vehicle_numbers(name: str) -> dict[str, Any]:
    """Return the numbers of a shipped vehicle, in SI units, as values for JSON."""
    vehicle = load_vehicle(name)
    return {key: np.asarray(getattr(vehicle, key), dtype=float).tolist() for key in _NAMES}
