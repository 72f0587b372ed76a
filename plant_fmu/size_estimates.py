"""Rough numbers of a vehicle from its mass and size alone: a start for an identification."""

from __future__ import annotations

from typing import Any

import numpy as np

_GRAVITY, _WATER = 9.81, 1000.0  # m/s2, kg/m3
_DRAG = 1.0  # drag coefficient of a bluff body
_SPEED = 0.3  # m/s, at which linear damping is as large as quadratic damping
_ADDED = (0.5, 1.0, 1.2)  # added mass along the axes, by the vehicle's mass
_CENTER = 0.05  # of the height, by which the center of buoyancy is above that of gravity


def complete_tables(tables: dict[str, Any]) -> dict[str, Any]:
    """Return the tables of a vehicle's file, with those that are missing estimated from mass and ``hull.size``."""
    hull, body = tables.get("hull"), tables.get("rigid_body")
    if not isinstance(hull, dict) or not isinstance(body, dict) or "size" not in hull or "mass" not in body:
        return tables
    try:
        size, mass = np.array(hull["size"], float), float(body["mass"])
    except (TypeError, ValueError):
        return tables  # which the check of types refuses by name
    if size.shape != (3,) or not (size > 0.0).all() or not mass > 0.0:
        return tables
    length, width, height = size.tolist()
    squares = np.square(size)
    inertia = mass / 12.0 * (squares.sum() - squares)
    quadratic = 0.5 * _WATER * _DRAG * np.array([width * height, length * height, length * width])
    turning = quadratic[[1, 2, 1]] * np.array([height, length, length]) ** 3 / 32.0
    damping = np.concatenate([quadratic, turning])
    weight = _GRAVITY * mass
    estimates: dict[str, dict[str, Any]] = {
        "rigid_body": {"inertia": inertia.tolist(), "center_of_gravity": [0.0] * 3, "weight": weight},
        "hydrostatics": {"buoyancy": weight, "center_of_buoyancy": [0.0, 0.0, -_CENTER * height]},
        "hydrodynamics": {
            "added_mass": [*(mass * np.array(_ADDED)).tolist(), *(0.5 * inertia).tolist()],
            "linear_damping": (_SPEED * damping).tolist(), "quadratic_damping": damping.tolist(),
        },
        "hull": {"radius": 0.5 * height},
    }  # fmt: skip
    if "thrusters" not in tables:  # what moves it is a wrench
        estimates["thrusters"] = {"matrix": [[0.0]] * 6, "force_min": 0.0, "force_max": 0.0}
    name = str(tables.get("name", ""))
    texts = {"title": name, "source": "Estimated from mass and size, where the file says nothing else."}
    return texts | tables | {
        key: estimate | table
        for key, estimate in estimates.items() if isinstance(table := tables.get(key, {}), dict)
    }  # fmt: skip
