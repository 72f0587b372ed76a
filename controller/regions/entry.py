"""The entry of a shape: all properties that the software uses, in one place."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Literal, NamedTuple

from controller.regions.shape import Array, Bounds, Shape, Vector3
from controller.regions.triangle_mesh import Mesh

_FACES = ("unit", "packed", "numbers", "bounds")


class ViewCone(NamedTuple):
    """A cone at the vehicle, which stands for a shape of attitude in pictures."""

    frame: Literal["vehicle", "body"]  # at the vehicle, parallel to the world; or the body frame
    apex: Vector3  # m, in that frame
    axis: Vector3  # in that frame
    half_angle: float  # rad
    feature: Vector3 | None = None  # m, NED: what the camera must see; None of a shape without a position


@dataclass(frozen=True)
class Entry:
    """The properties of a shape, which its file in `controller.regions.shapes` defines as ``ENTRY``."""

    shape: type[Shape]  # frozen dataclass, a `Shape`: its fields are the keys of a scenario
    evaluate: Callable[..., Any]  # compiled function of g, its gradient and the distance, as `Shape` describes it
    example: Shape  # instance of the shape, for tests and pictures
    units: Mapping[str, str]  # unit of each field of the dataclass, "" for none
    # true if the clearance has a constant gradient along each face, as of a box
    flat_faces: bool
    # where the clearance has kinks: nowhere, as of a half space; inside, as at the center of a sphere; inside and
    # outside, where two faces are equally near
    kinks: Literal["nowhere", "inside", "everywhere"]
    # true if every instance is convex. Rays, such as those of a proximity sensor, then step by tangents, otherwise by
    # distances
    convex: bool
    # function that returns the point by which targets are placed, to the last bit [m, NED]; None for the middle of
    # `bounds`, which is rounded
    center: Callable[[Any], Vector3] | None
    # function that makes the mesh of an instance within a box, which cuts an unbounded shape. Pictures, replay and
    # exports draw it. A shape of attitude has a cone instead
    surface: Callable[[Any, Bounds], Mesh] | None = None
    cone: Callable[[Any], ViewCone] | None = None
    # function of an ellipsoid that returns its center [m, NED], shape (3,), and its half axes as rows [m], shape (3,
    # 3). Pictures then draw the exact ellipse of its outline, not its mesh
    half_axes: Callable[[Any], tuple[Array, Array]] | None = None
    # function of an unbounded shape that returns a point [m, NED] and the outward unit normal of each bounding plane.
    # Pictures then cut the planes where the picture ends
    planes: Callable[[Any], Sequence[tuple[Array, Array]]] | None = None

    @property
    def of_attitude(self) -> bool:
        """True if the shape depends on attitude."""
        return self.cone is not None

    @property
    def has_position(self) -> bool:
        """True if the shape can move."""
        return self.cone is None or self.cone(self.example).feature is not None

    def __post_init__(self) -> None:
        name = self.shape.__name__
        missing = [face for face in _FACES if not hasattr(self.shape, face)]
        if missing:
            raise TypeError(f"shape {name} has no {', '.join(missing)}")
        if (self.surface is None) == (self.cone is None):
            raise TypeError(f"shape {name} has {'both' if self.cone else 'neither'}, expected a surface or a cone")
        if type(self.example) is not self.shape:
            raise TypeError(f"shape {name}: example is a {type(self.example).__name__}, expected one of its own")
        keys = [field.name for field in fields(self.shape)]  # type: ignore[arg-type]
        if sorted(self.units) != sorted(keys):
            raise TypeError(f"shape {name}: units are of {', '.join(self.units)}, expected of {', '.join(keys)}")
        # those of a file are read when they are first needed
        packed, named = (0, 0) if "file" in keys else (len(self.example.packed()), len(self.example.numbers()))
        if packed != named:
            raise TypeError(f"shape {name}: numbers names {named} numbers, expected the {packed} that packed gives")
