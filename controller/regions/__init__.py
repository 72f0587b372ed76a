"""Regions: where the vehicle shall be, and where it shall not.

Imports: jit.
"""

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
from controller.regions.shapes.box import Box
from controller.regions.shapes.cone import Cone
from controller.regions.shapes.cylinder import Cylinder
from controller.regions.shapes.depth_band import DepthBand
from controller.regions.shapes.ellipsoid import Ellipsoid
from controller.regions.shapes.half_space import HalfSpace
from controller.regions.shapes.orientation import Orientation
from controller.regions.shapes.pipe import Pipe
from controller.regions.shapes.prism import Prism
from controller.regions.shapes.sphere import Sphere
from controller.regions.shapes.visibility import Visibility

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
