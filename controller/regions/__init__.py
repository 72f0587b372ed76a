"""Regions: sets of poses that the vehicle shall reach or avoid.

Imports: compiling, translator.
"""

from controller.regions.region_set import Region, pack
from controller.regions.shapes.box import Box
from controller.regions.shapes.cone import Cone
from controller.regions.shapes.cylinder import Cylinder
from controller.regions.shapes.depth_band import DepthBand
from controller.regions.shapes.ellipsoid import Ellipsoid
from controller.regions.shapes.half_space import HalfSpace
from controller.regions.shapes.mesh import Mesh
from controller.regions.shapes.orientation import Orientation
from controller.regions.shapes.pipe import Pipe
from controller.regions.shapes.points import Points
from controller.regions.shapes.prism import Prism
from controller.regions.shapes.sphere import Sphere
from controller.regions.shapes.visibility import Visibility

__all__ = [
    "Box",
    "Cone",
    "Cylinder",
    "DepthBand",
    "Ellipsoid",
    "HalfSpace",
    "Mesh",
    "Orientation",
    "Pipe",
    "Points",
    "Prism",
    "Region",
    "Sphere",
    "Visibility",
    "pack",
]
