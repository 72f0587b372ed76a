"""Where the axes of a file of positions point."""

from __future__ import annotations

import numpy as np

from controller.regions.shape import Array, Vector3, require, require_finite

# rows: north, east and down of a file's x, y and z
AXES = {
    "ned": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "nwu": ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0)),
    "enu": ((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0)),
}


def require_frame(shape: str, axes: str, scale: float, position: Vector3) -> None:
    """Require axes that are known, a scale above 0 and a finite position [m, NED]."""
    require(axes in AXES, shape, "axes", repr(axes), f"one of {', '.join(AXES)}: north, east, down, west, up")
    require_finite(shape, scale=scale, position=position)
    require(scale > 0.0, shape, "scale", scale, "above 0 m: 0.001 for a file in millimeters")


def file_to_ned(axes: str) -> Array:
    """Return the rotation from a file's axes to north, east and down."""
    return np.array(AXES[axes])
