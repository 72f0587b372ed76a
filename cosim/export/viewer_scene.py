"""Scene of a run for three-dimensional viewers: regions in their colors, the vehicle, and its path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from controller.regions.region_set import SHAPES, shape_entry, surface_of
from controller.regions.shape import Bounds, Shape
from controller.regions.triangle_mesh import Mesh, sector
from cosim.export.excerpt import Excerpt
from cosim.replay.header import header_of
from cosim.replay.region_changes import list_region_changes, read_command_log
from cosim.results.region_colors import colors_of_regions
from cosim.simulation.signals import Array

NED, PLACE, BODY = "ned", "place", "body"  # frames: world; at the vehicle, parallel to the world; body
_FRAMES = {"vehicle": PLACE, "body": BODY}  # of the cones that stand for shapes of attitude
POSITION = ("position.x", "position.y", "position.z")
QUATERNION = ("quaternion.e0", "quaternion.e1", "quaternion.e2", "quaternion.e3")
HULL_COLOR, TRAIL_COLOR, THRUST_COLOR = (240, 228, 66), (140, 140, 140), (204, 121, 167)
OPAQUE = {False: 0.25, True: 0.75}  # opacity by activity of the region
_MARGIN = 1.0  # m, around path and bounded regions
_SIGHT = 5.0  # hull radii, length of the drawing of an attitude region
_TRAIL = 2000  # maximum number of points of the path


@dataclass(frozen=True, eq=False)
class Solid:
    """A region with its drawing."""

    name: str
    label: str  # name and side to keep
    color: tuple[int, int, int]
    shape: Shape
    mesh: Mesh
    frame: str  # frame of the coordinates: `NED`, `PLACE` or `BODY`
    moves: bool  # True if the record has the region's shift

    @property
    def shift(self) -> list[str]:
        """Names of the signals of a moving region's shift."""
        return [f"{self.name}.shift.{axis}" for axis in "xyz"]


@dataclass(frozen=True, eq=False)
class Thruster:
    """A thruster in the body frame."""

    position: Array  # (3,) m
    direction: Array  # (3,) unit vector of positive force
    max_force: float  # N, maximum magnitude of the force


class Scene:
    """The scene of a run."""

    def __init__(self, excerpt: Excerpt) -> None:
        self._excerpt = excerpt
        scenario = excerpt.run.scenario
        vehicle = header_of(scenario, excerpt.run.record.columns)["vehicle"]
        self.hull_radius: float = vehicle["radius"]  # radius of the drawn hull [m]
        self.thrusters = tuple(
            Thruster(np.array(t["position"]), np.array(t["direction"]), max(abs(t["min"]), abs(t["max"])))
            for t in vehicle["thrusters"]
        )
        self.log = read_command_log(excerpt.run)
        at_start = [excerpt.run.planned.goal, *(r.region.shape for r in scenario.regions)]
        later = [(c["time"], c["region"], _shape(c["shape"])) for c in list_region_changes(excerpt.run, self.log)]
        # the shapes of free obstacle slots are at the parked position, far away
        waiting = {i + 1 for i, secondary in enumerate(scenario.regions) if secondary.is_dynamic}
        waiting |= set() if scenario.has_goal else {0}
        all_shapes = [*enumerate(at_start), *((i, shape) for _, i, shape in later)]
        limits = self._limits([shape for i, shape in all_shapes if i not in waiting])
        self.solids = tuple(self._solid(i, shape, limits) for i, shape in enumerate(at_start))
        # changes of these solids: time [s], index, and new solid
        self.changes = tuple((time, i, self._solid(i, shape, limits)) for time, i, shape in later)

    def trail(self) -> Array:
        """Return the path of the vehicle, thinned to at most 2000 points, shape (n, 3) [m, NED]."""
        n = self._excerpt.count
        path = self._excerpt.take(np.unique(np.linspace(0, n - 1, min(n, _TRAIL)).astype(int)), POSITION).to_array()
        return path[np.isfinite(path).all(axis=1)]

    def _solid(self, index: int, shape: Shape, limits: Bounds) -> Solid:
        scenario = self._excerpt.run.scenario
        secondary = scenario.regions[index - 1] if index else None
        region = secondary.region if secondary else scenario.goal_region
        return Solid(
            region.name,
            f"{region.name}: keep {region.keep}",
            _rgb(colors_of_regions(scenario)[index]),
            shape,
            self._mesh(shape, limits),
            _FRAMES[cone(shape).frame] if (cone := shape_entry(shape).cone) else NED,
            region.name in scenario.moving,
        )

    def _limits(self, shapes: list[Shape]) -> Bounds:
        """Return the corners of a bounding box of the path and the bounded regions, with a margin."""
        path = self.trail()
        points = [path.min(axis=0), path.max(axis=0)] if len(path) else [np.zeros(3)]
        bounds = [corner for shape in shapes for corner in shape.bounds()]
        points += [np.array(corner) for corner in bounds if np.isfinite(corner).all()]
        low, high = np.min(points, axis=0) - _MARGIN, np.max(points, axis=0) + _MARGIN
        return tuple(low.tolist()), tuple(high.tolist())

    def _mesh(self, shape: Shape, limits: Bounds) -> Mesh:
        cone = shape_entry(shape).cone
        if cone is None:
            return surface_of(shape, limits)
        drawn = cone(shape)
        return sector(drawn.apex, drawn.axis, drawn.half_angle, _SIGHT * self.hull_radius)


def _rgb(color: str) -> tuple[int, int, int]:
    red, green, blue = bytes.fromhex(color.removeprefix("#"))
    return red, green, blue


def _shape(numbers: dict[str, Any]) -> Shape:
    """Make a shape from its table."""
    return SHAPES[numbers["kind"]](**{key: value for key, value in numbers.items() if key not in ("kind", "drawing")})
