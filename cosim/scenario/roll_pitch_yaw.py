"""Attitudes of a scenario's file that are given by angles in place of a quaternion."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np

from controller import quaternion
from cosim.errors import ScenarioError
from cosim.scenario.region_tables import Vector3
from cosim.scenario.toml_file import ANGLE_KEYS, shapes_in, takes_key
from plant_fmu.toml_tables import decode


def with_quaternions(table: dict[str, Any]) -> dict[str, Any]:
    """Return a scenario's table with a quaternion for the angles roll, pitch, yaw (zyx) [rad] of each attitude."""
    if not any(_attitudes(table)):
        return table
    table = msgspec.to_builtins(table)  # a copy
    for where, key, holder in _attitudes(table):
        if key in holder:
            raise ScenarioError(f"{where}: pass either {key} or {ANGLE_KEYS[key]}")
        angles = decode(holder.pop(ANGLE_KEYS[key]), Vector3, f"{where}.{ANGLE_KEYS[key]}")
        roll, pitch, yaw = (quaternion.from_axis_angle(axis, a) for axis, a in zip(np.eye(3), angles, strict=True))
        holder[key] = quaternion.multiply(quaternion.multiply(yaw, pitch), roll).tolist()
    return table


def _attitudes(table: dict[str, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield where angles are given, the key of the quaternion that they replace, and the table that holds them."""
    holders = {name: holder for name in ("initial", "law") if isinstance(holder := table.get(name), dict)}
    for where, holder in (holders | shapes_in(table)).items():
        for key, angles in ANGLE_KEYS.items():
            # a shape without a quaternion, such as a user's, may have a key of that name
            if angles in holder and (not isinstance(holder.get("type"), str) or takes_key(holder, "quaternion")):
                yield where, key, holder
