"""Regions: where the vehicle shall be, and where it shall not.

Imports: jit.
"""

from controller.regions.box import Box
from controller.regions.cone import Cone
from controller.regions.cylinder import Cylinder
from controller.regions.depth_band import DepthBand
from controller.regions.ellipsoid import Ellipsoid
from controller.regions.half_space import HalfSpace
from controller.regions.orientation import Orientation
from controller.regions.pipe import Pipe
from controller.regions.prism import Prism
from controller.regions.rays import ray_distances
from controller.regions.region_set import (
    SHAPES,
    PackedRegions,
    Region,
    attitude_clearance,
    clearance_at,
    clearance_of_place,
    clearance_of_pose,
    clearance_of_sphere,
    clearances_at,
    evaluate_packed,
    of_attitude,
    pack,
    place_clearance,
)
from controller.regions.shape import Shape
from controller.regions.sphere import Sphere
from controller.regions.visibility import Visibility

__all__ = [
    "SHAPES",
    "Box",
    "Cone",
    "Cylinder",
    "DepthBand",
    "Ellipsoid",
    "HalfSpace",
    "Orientation",
    "PackedRegions",
    "Pipe",
    "Prism",
    "Region",
    "Shape",
    "Sphere",
    "Visibility",
    "attitude_clearance",
    "clearance_at",
    "clearance_of_place",
    "clearance_of_pose",
    "clearance_of_sphere",
    "clearances_at",
    "evaluate_packed",
    "of_attitude",
    "pack",
    "place_clearance",
    "ray_distances",
]
