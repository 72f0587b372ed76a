"""Regions of a scene: shapes that are kept within or kept out of, evaluated together."""

# One sign for the whole project: g <= 0 is satisfied, g > 0 is violated.

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import length3
from controller.compiling.function import BoundCall, CompiledFunction
from controller.errors import RegionError
from controller.regions.entry import Entry
from controller.regions.kinds import DEPTH_BAND, FIRST_OF_ATTITUDE, SPHERE, evaluate_shape, evaluate_shape_of_attitude
from controller.regions.shape import (
    Array,
    Bounds,
    Evaluation,
    EvaluationOfAttitude,
    Shape,
    Vector3,
    require,
    require_finite,
)
from controller.regions.shapes import ENTRIES
from controller.regions.shapes.depth_band import band_about
from controller.regions.shapes.sphere import sphere_about
from controller.regions.triangle_mesh import Mesh
from controller.stack_array import Rows3
from controller.stack_array import Vector3 as Point

SHAPES: dict[str, type[Shape]] = {name: entry.shape for name, entry in ENTRIES.items()}


@dataclass(frozen=True)
class Region:
    """A shape to be kept within (``"in"``), or kept out of (``"out"``), at rest or moving.

    The vehicle must not violate a hard region; a soft one pushes. Each law documents whether it distinguishes them.

    Examples
    --------
    >>> from controller.regions import Region, Sphere
    >>> Region("rock", Sphere((2.0, 0.0, 2.0), 0.5), keep="out", gain=100.0).hard
    True
    """

    name: str
    shape: Shape  # shape at its position at time 0
    keep: Literal["in", "out"]
    velocity: Vector3 = (0.0, 0.0, 0.0)  # m/s, NED
    gain: float = 1.0  # alpha_i of section VII, in N per unit of g
    hard: bool = True
    deviation: float | Vector3 = 0.0  # m, standard deviation of its position: in any direction, or north, east and down
    crossing_cost: float = 2.0  # m, added to a path's length per meter through a soft region, half a meter deep

    @property
    def deviations(self) -> Vector3:
        """Standard deviations of its position, north, east and down [m]."""
        return deviations_of(self.deviation)

    def __post_init__(self) -> None:
        if self.keep not in ("in", "out"):
            raise RegionError(f"region {self.name!r}: keep is {self.keep!r}, expected 'in' or 'out'")
        require_finite(f"region {self.name!r}", velocity=self.velocity)
        require(0.0 <= self.gain < math.inf, f"region {self.name!r}", "gain", self.gain, "a finite number, 0 or above")
        require(
            all(0.0 <= deviation < math.inf for deviation in self.deviations), f"region {self.name!r}", "deviation",
            self.deviation, "0 m or above, one number or three",
        )  # fmt: skip
        cost = self.crossing_cost
        require(0.0 <= cost < math.inf, f"region {self.name!r}", "crossing_cost", cost, "a finite number, 0 or above")
        at_rest = not any(self.velocity) or shape_entry(self.shape).has_position
        require(at_rest, f"region {self.name!r}", "velocity", self.velocity, "none: the shape has no position")


def deviations_of(deviation: float | Vector3) -> Vector3:
    """Return the standard deviations north, east and down from one number, or three."""
    if isinstance(deviation, float | int):
        return (float(deviation),) * 3
    north, east, down = deviation
    return float(north), float(east), float(down)


def name_of(shape: Shape) -> str:
    """Return the name of a shape's kind, such as ``"depth_band"``."""
    for name, kind in SHAPES.items():
        if type(shape) is kind:
            return name
    raise RegionError(f"shape is of type {type(shape).__name__}, expected one of {', '.join(SHAPES)}")


def surface_of(shape: Shape, limits: Bounds) -> Mesh:
    """Return the surface of a shape of position."""
    surface = shape_entry(shape).surface
    if surface is None:
        raise RegionError(f"shape {name_of(shape)!r} has no surface, expected one of a shape of position")
    return surface(shape, limits)


def shape_entry(shape: Shape) -> Entry:
    """Return the entry of a shape's kind."""
    return ENTRIES[name_of(shape)]


def shape_center(shape: Shape) -> Vector3:
    """Return the center of a shape, the point [m, NED] by which targets are placed."""
    center = shape_entry(shape).center
    if center is not None:
        return center(shape)
    middle = [0.0, 0.0, 0.0]
    for axis, (low, high) in enumerate(zip(*shape.bounds(), strict=True)):
        ends = [end for end in (low, high) if math.isfinite(end)]
        middle[axis] = sum(ends) / len(ends) if ends else 0.0
    return middle[0], middle[1], middle[2]


def of_attitude(shape: Shape) -> bool:
    """Return True if a shape depends on attitude, so that its clearance is in rad instead of m."""
    return shape.kind >= FIRST_OF_ATTITUDE


class PackedRegions(NamedTuple):
    """Regions as arrays, which C reads."""

    # Only `shifts` and `velocities` change, when regions move.

    kinds: NDArray[np.int64]  # (n,) number of each shape's kind
    signs: Array  # (n,) +1 kept within, -1 kept out of
    offsets: NDArray[np.int64]  # (n + 1,) into `numbers`
    numbers: Array  # packed numbers of the shapes, consecutive
    shifts: Rows3  # m, NED: displacement of each from its packed place
    velocities: Rows3  # m/s, NED
    gains: Array  # (n,) alpha_i
    hard: NDArray[np.bool_]  # (n,) True for a hard region
    deviations: Rows3  # m, standard deviations of each place, NED
    crossing_costs: Array  # (n,) m, added to a path's length per meter through each, half a meter deep

    def evaluate(
        self,
        position: Array,
        quaternion: Array,
        values: Array,
        gradients: Array,
        rotation_gradients: Array,
        clearances: Array,
    ) -> None:
        """Evaluate every region at a pose, into the given arrays; position [m, NED], clearances [m]."""
        for array in (position, quaternion, values, gradients, rotation_gradients, clearances):
            require(array.flags.c_contiguous, "evaluate", "array", "a strided one", "contiguous ones")
        _evaluate(self, position, quaternion, values, gradients, rotation_gradients, clearances)

    def move_to(self, time: float) -> None:
        """Move every region by its velocity to its position at a time [s]."""
        np.multiply(self.velocities, time, out=self.shifts)


def pack(regions: Sequence[Region]) -> PackedRegions:
    """Pack regions into arrays, as they are at time 0.

    Parameters
    ----------
    regions : sequence of Region
        Regions, none or more.

    Returns
    -------
    PackedRegions
        Packed regions in the same order.

    Examples
    --------
    >>> import numpy as np
    >>> from controller.regions import DepthBand, Region, Sphere, pack
    >>> regions = pack([Region("rock", Sphere((2.0, 0.0, 2.0), 0.5), "out"), Region("band", DepthBand(2.0, 0.5), "in")])
    >>> g, slopes, turns, clearances = np.zeros(2), np.zeros((2, 3)), np.zeros((2, 3)), np.zeros(2)
    >>> regions.evaluate(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), g, slopes, turns, clearances)
    >>> clearances.round(3)
    array([ 2.328, -1.5  ])
    """
    packed = [region.shape.packed() for region in regions]
    kinds = np.array([region.shape.kind for region in regions], dtype=np.int64)
    return PackedRegions(
        kinds=kinds,
        signs=np.array([1.0 if region.keep == "in" else -1.0 for region in regions]),
        offsets=np.cumsum([0, *(len(numbers) for numbers in packed)], dtype=np.int64),
        numbers=np.array([x for numbers in packed for x in numbers], dtype=float),
        shifts=np.zeros((len(regions), 3)),
        velocities=np.array([region.velocity for region in regions], dtype=float).reshape(-1, 3),
        gains=np.array([region.gain for region in regions], dtype=float),
        hard=np.array([region.hard for region in regions], dtype=np.bool_),
        deviations=np.array([region.deviations for region in regions], dtype=float).reshape(-1, 3),
        crossing_costs=np.array([region.crossing_cost for region in regions], dtype=float),
    )


def evaluate_packed(
    regions: PackedRegions,
    position: Point,
    quaternion: Array,
    values: Array,
    gradients: Array,
    rotation_gradients: Array,
    clearances: Array,
) -> None:
    """Evaluate `regions` as `PackedRegions.evaluate`, for functions that are themselves run as C."""
    for i in range(regions.kinds.size):
        tx, ty, tz = 0.0, 0.0, 0.0
        if regions.kinds[i] < FIRST_OF_ATTITUDE:
            g, gx, gy, gz, distance = evaluate_at(regions, i, position)
        else:
            g, gx, gy, gz, tx, ty, tz = evaluate_pose(regions, i, position, quaternion)
            distance = g
        sign = regions.signs[i]
        values[i], clearances[i] = sign * g, -sign * distance
        gradients[i, 0], gradients[i, 1], gradients[i, 2] = sign * gx, sign * gy, sign * gz
        rotation_gradients[i, 0], rotation_gradients[i, 1], rotation_gradients[i, 2] = sign * tx, sign * ty, sign * tz


def evaluate_at(regions: PackedRegions, i: int, position: Point) -> Evaluation:
    """Evaluate the shape of region `i`, of position alone, where it is now, at a `position` [m, NED]."""
    # Spheres and bands of depth, the most frequent, go without the choice among all kinds.
    place = position - regions.shifts[i]
    kind, q, first = regions.kinds[i], regions.numbers, regions.offsets[i]
    if kind == SPHERE:
        return sphere_about(place[0] - q[first], place[1] - q[first + 1], place[2] - q[first + 2], q[first + 3])
    if kind == DEPTH_BAND:
        return band_about(place[2] - q[first], q[first + 1])
    evaluation: Evaluation = evaluate_shape(kind, place, q[first : regions.offsets[i + 1]])
    return evaluation


def evaluate_pose(regions: PackedRegions, i: int, position: Point, e: Array) -> EvaluationOfAttitude:
    """Evaluate the shape of region `i`, of attitude, where it is now, at a pose; position [m, NED]."""
    numbers, place = regions.numbers[regions.offsets[i] : regions.offsets[i + 1]], position - regions.shifts[i]
    evaluation: EvaluationOfAttitude = evaluate_shape_of_attitude(regions.kinds[i], place, e, numbers)
    return evaluation


def clearance_at(regions: PackedRegions, i: int, position: Point) -> float:
    """Return the clearance [m] of one of the `regions`, `i`, where it is now, at a position [m, NED]."""
    # Infinite for shapes that depend on attitude: they block no position. That of a sphere alone is twenty times as
    # fast as its whole evaluation.
    if regions.kinds[i] >= FIRST_OF_ATTITUDE:
        return math.inf
    if regions.kinds[i] == SPHERE:
        first, q, place = regions.offsets[i], regions.numbers, position - regions.shifts[i]
        distance = length3(place[0] - q[first], place[1] - q[first + 1], place[2] - q[first + 2]) - q[first + 3]
    else:
        distance = evaluate_at(regions, i, position)[4]
    clearance: float = -regions.signs[i] * distance
    return clearance


def clearance_of_pose(regions: PackedRegions, i: int, position: Point, quaternion: Array) -> float:
    """Return the clearance of one of the `regions`, `i`, of any kind, [m] or [rad], at a pose; position [m, NED]."""
    if regions.kinds[i] < FIRST_OF_ATTITUDE:
        return clearance_at(regions, i, position)
    clearance: float = -regions.signs[i] * evaluate_pose(regions, i, position, quaternion)[0]
    return clearance


def attitude_clearance(regions: PackedRegions, i: int, position: Point, quaternion: Array, slope: Array) -> float:
    """Return the clearance [rad] of one of the `regions`, `i`, of attitude."""
    # The function writes its `slope` by rotation in body axes, shape (3,). The pose is a `position` [m, NED] and a unit
    # `quaternion`.
    sign = regions.signs[i]
    g, _, _, _, x, y, z = evaluate_pose(regions, i, position, quaternion)
    slope[0], slope[1], slope[2] = -sign * x, -sign * y, -sign * z
    clearance: float = -sign * g
    return clearance


def position_clearance(regions: PackedRegions, i: int, position: Point, slope: Array) -> float:
    """Return the clearance [m] of one of the `regions`, `i`, of position alone."""
    # The function writes its `slope` at the `position`, shape (3,), of length 1 or 0.
    _, x, y, z, distance = evaluate_at(regions, i, position)
    size, sign = math.sqrt(x * x + y * y + z * z), regions.signs[i]
    scale = -sign / size if size > 0.0 else 0.0
    slope[0], slope[1], slope[2] = scale * x, scale * y, scale * z
    clearance: float = -sign * distance
    return clearance


def clearances_at(points: Array, region: Region) -> Array:
    """Return the clearance of a region at many points, as it is at time 0; points (m, 3) [m, NED]."""
    clearances = np.empty(len(points))
    arguments = pack([region]), np.ascontiguousarray(points, dtype=float), clearances
    BoundCall(write_clearances, arguments).call()
    return clearances


def evaluate_at_pose(
    regions: Sequence[Region], position: Sequence[float] | Array, quaternion: Sequence[float]
) -> tuple[Array, Array, Array]:
    """Return values, gradients and clearances of regions at a pose, as they are at time 0; position [m, NED]."""
    values, gradients, _, clearances = RegionEvaluator(pack(regions)).evaluate(position, quaternion)
    return values, gradients, clearances


class RegionEvaluator:
    """Evaluates regions by arrays of its own, the same ones each time: C is bound to arrays."""

    def __init__(self, regions: PackedRegions) -> None:
        self.regions, n = regions, regions.kinds.size
        self._pose = np.zeros(3), np.zeros(4)
        self._out = np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n)

    def evaluate(
        self, position: Sequence[float] | Array, quaternion: Sequence[float] | Array
    ) -> tuple[Array, Array, Array, Array]:
        """Return values, gradients, gradients by rotation and clearances at a pose; position [m, NED]."""
        for name, given, kept in zip(("position", "quaternion"), (position, quaternion), self._pose, strict=True):
            require(np.shape(given) == kept.shape, "evaluate", f"{name}'s shape", np.shape(given), str(kept.shape))
            kept[:] = given
        self.regions.evaluate(*self._pose, *self._out)
        values, gradients, rotation_gradients, clearances = (part.copy() for part in self._out)
        return values, gradients, rotation_gradients, clearances


def write_clearances(regions: PackedRegions, points: Rows3, clearances: Array) -> None:
    """Write `clearance_at` of the first of the `regions` at each of the points."""
    for i in range(points.shape[0]):
        clearances[i] = clearance_at(regions, 0, points[i])


_evaluate = CompiledFunction(evaluate_packed)
