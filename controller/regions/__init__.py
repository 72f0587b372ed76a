"""Regions: where the vehicle shall be, and where it shall not."""

from controller.regions.box import Box
from controller.regions.cone import Cone
from controller.regions.cylinder import Cylinder
from controller.regions.depth_band import DepthBand
from controller.regions.ellipsoid import Ellipsoid
from controller.regions.half_space import HalfSpace
from controller.regions.pipe import Pipe
from controller.regions.prism import Prism
from controller.regions.region_set import (
    SHAPES,
    PackedRegions,
    Region,
    clearance_at,
    clearances_at,
    evaluate_packed,
    pack,
)
from controller.regions.shape import Shape
from controller.regions.sphere import Sphere

__all__ = [
    "SHAPES",
    "Box",
    "Cone",
    "Cylinder",
    "DepthBand",
    "Ellipsoid",
    "HalfSpace",
    "PackedRegions",
    "Pipe",
    "Prism",
    "Region",
    "Shape",
    "Sphere",
    "clearance_at",
    "clearances_at",
    "evaluate_packed",
    "pack",
]
