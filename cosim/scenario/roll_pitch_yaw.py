"""Attitudes of a scenario's file that are given by angles in place of a quaternion."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np

from controller import quaternion
from cosim.errors import ScenarioError
from cosim.scenario.region_tables import Vector3
from cosim.scenario.toml_file import ANGLE_KEYS
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
    holders = {name: table.get(name) for name in ("initial", "law", "goal")}
    regions = table.get("regions")
    for i, region in enumerate(regions if isinstance(regions, list | tuple) else ()):
        holders[f"regions[{i}].shape"] = region.get("shape") if isinstance(region, dict) else None
    for where, holder in holders.items():
        for key, angles in ANGLE_KEYS.items():
            if isinstance(holder, dict) and angles in holder and not _is_own_shape(holder):
                yield where, key, holder


def _is_own_shape(holder: dict[str, Any]) -> bool:
    """Return True for a shape without a quaternion, such as a user's, which may have a key of that name."""
    from controller.regions.shapes import ENTRIES

    kind = holder.get("type")
    return isinstance(kind, str) and (kind not in ENTRIES or "quaternion" not in ENTRIES[kind].units)
