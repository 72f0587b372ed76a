"""Missions: what the goal asks for in turn, as a table of legs."""

# A leg is a goal region with a stay, or a way along which the goal glides from the leg before. Rings and polylines are
# such ways between places, so that a step knows only legs.

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Literal, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from controller.quaternion import rotation_matrix
from controller.regions import Sphere
from controller.regions.shape import Shape
from controller.regions.shapes.visibility import Visibility
from cosim.errors import ScenarioError
from cosim.scenario.region_tables import PARKED_POSITION, SecondaryRegion, Vector3, Vector4
from plant_fmu.toml_tables import Finite, NonNegative, Positive, Table, key, require

Array = NDArray[np.float64]

TURNING_RATE = 0.4  # rad/s, greatest of the heading that a mission asks for
_NOWHERE: Vector3 = (math.nan, math.nan, math.nan)
_PACE = 0.25  # m/s, of the goal along rings and polylines, if none is given
_SEGMENTS = 36  # straight pieces of a ring
_MAX_LEGS = 2000
_MAX_POINTS = 200  # of a polyline, or rings of an orbit
_MAX_TURNS = 20.0
_ALONG = 0.999  # cosine of its angle to north from which an axis counts as northern
_SHORTEST = 1e-6  # m, of a way along which the goal glides

Heading = Annotated[
    Finite | Literal["feature", "kept"] | None,
    key(
        "heading there, clockwise from north; `feature`: the camera, or without one the bow, towards the feature",
        "rad", "; `kept`: as `law.desired_quaternion`", default="`kept`; of an orbit `feature`",
    ),
]  # fmt: skip
Feature = Annotated[
    Vector3 | None,
    key(
        "point to look at from there: features of regions of visibility go there", "m",
        default="that of the place before; of an orbit its axis",
    ),
]  # fmt: skip


class GoalEntry(Table, frozen=True):
    """A further place of the goal, or the way of rings or of a polyline."""

    type: Annotated[
        Literal["place", "orbit", "path"],
        key("`place`, `orbit`: rings about an axis, or `path`: a polyline, along which the goal moves"),
    ] = "place"
    center: Annotated[
        Vector3 | None, key("center of the place, or point on the axis of the rings", "m", default="required")
    ] = None
    points: Annotated[tuple[Vector3, ...], key("corners of the polyline", "m")] = ()
    radius: Annotated[Positive | None, key("of the rings", "m", default="required of an orbit")] = None
    rings: Annotated[tuple[Finite, ...], key("where the rings are along the axis, from `center`", "m")] = (0.0,)
    axis: Annotated[Vector3, key("direction of the axis of the rings, north east down")] = (0.0, 0.0, 1.0)
    bearing: Annotated[
        Finite, key("where the first ring begins: from north about the axis, or from east if that is north", "rad")
    ] = 0.0  # fmt: skip
    turns: Annotated[Finite, key("turns in each ring; negative: anticlockwise as seen against the axis")] = 1.0
    tolerance: Annotated[
        Positive | None, key("radius of a spherical goal there: of a polyline, its tube's", "m", default="the goal's")
    ] = None
    stay: Annotated[
        NonNegative | None, key("time within the goal there", "s", default="`goal.stay`; of rings and corners 0")
    ] = None
    heading: Heading = None
    feature: Feature = None
    speed: Annotated[
        Positive | None,
        key(
            "greatest speed that the law aims at on the way there; of an orbit or a path: the goal's along it", "m/s",
            default="the law's; of an orbit or a path 0.25",
        ),
    ] = None  # fmt: skip

    def __post_init__(self) -> None:
        own = {
            "place": {"center"},
            "orbit": {"center", "radius", "rings", "axis", "bearing", "turns"},
            "path": {"points"},
        }
        defaults = dict(zip(self.__struct_fields__, self.__struct_defaults__, strict=True))
        for name in set.union(*own.values()) - own[self.type]:
            value = getattr(self, name)
            require(value == defaults[name], name, value, f"none with type = {self.type!r}")
        for name in sorted(own[self.type] & {"center", "radius"}):
            require(getattr(self, name) is not None, name, "missing", f"one with type = {self.type!r}")
        if self.type == "orbit":
            require(0 < len(self.rings) <= _MAX_POINTS, "rings", f"{len(self.rings)} numbers", f"1 to {_MAX_POINTS}")
            require(math.hypot(*self.axis) > 0.0, "axis", self.axis, "a direction")
            ok = 0.0 < abs(self.turns) <= _MAX_TURNS
            require(ok, "turns", self.turns, f"up to {_MAX_TURNS:g} in either direction, not 0")
            fastest = TURNING_RATE * (self.radius or 0.0)
            ok = self.heading not in (None, "feature") or self.pace <= fastest
            require(
                ok, "speed", f"{self.pace:g} m/s", f"at most {fastest:g}: the vehicle turns with {TURNING_RATE} rad/s"
            )
        if self.type == "path":
            ok = 2 <= len(self.points) <= _MAX_POINTS
            require(ok, "points", f"{len(self.points)} points", f"2 to {_MAX_POINTS}")

    @property
    def pace(self) -> float:
        """Speed of the goal along rings or a polyline [m/s]."""
        return _PACE if self.speed is None else self.speed


class GoalMotion(Table, frozen=True):
    """Keys of the goal beside those of its shape."""

    velocity: Annotated[
        Vector3, key("velocity of the goal, north east down", "m/s", "; as `regions[].velocity`")
    ] = (0.0, 0.0, 0.0)  # fmt: skip
    streamed: Annotated[bool, key("moved from outside during the run", more="; as `regions[].streamed`")] = False
    stay: Annotated[NonNegative, key("time within the goal before the goal moves to its next place", "s")] = 5.0
    heading: Heading = None
    feature: Feature = None
    speed: Annotated[
        Positive | None, key("greatest speed that the law aims at on the way there", "m/s", default="the law's")
    ] = None  # fmt: skip
    then: Annotated[
        tuple[Vector3 | GoalEntry, ...],
        key("next places of the goal in turn: centers, or tables", "m", ", [below](#missions)"),
    ] = ()  # fmt: skip

    @property
    def first_place(self) -> GoalEntry:
        """What the goal asks for at its first place."""
        return GoalEntry(
            center=PARKED_POSITION, stay=self.stay, heading=self.heading, feature=self.feature, speed=self.speed
        )


class Leg(NamedTuple):
    """A goal region, or the way to it from the leg before."""

    center: Vector3  # m, NED: center of the goal, or its end
    stop: int  # index of the place that the goal is at, or has left last
    pace: float = 0.0  # m/s, along the way; 0: the goal is there at once
    stay: float = 0.0  # s, within the goal before the next leg
    radius: float = math.nan  # m, of a spherical goal; NaN: as it is
    heading: float = math.nan  # rad; NaN: the law's own
    faces: bool = False  # True: towards the feature
    feature: Vector3 = _NOWHERE  # m, NED, at its end; NaN: none
    speed: float = math.inf  # m/s, greatest of the law


@dataclass(frozen=True)
class Mission:
    """The legs of a scenario's goal, and the regions of visibility whose features they move."""

    legs: tuple[Leg, ...]
    stops: tuple[str, ...]  # name of each place
    keys: tuple[str, ...]  # key of the position of each leg, such as ``goal.then.0.center``
    views: tuple[int, ...] = ()  # indices of the regions

    @property
    def places(self) -> tuple[Vector3, ...]:
        """Center of the goal at each stop [m, NED]."""
        return tuple(leg.center for leg in self.stop_legs)

    @property
    def stop_legs(self) -> tuple[Leg, ...]:
        """The leg of each stop, at which the goal rests."""
        return tuple(leg for leg in self.legs if leg.pace == 0.0)

    @property
    def next_stops(self) -> list[tuple[Leg, str]]:
        """The leg of each stop after the first, and the key of its position."""
        return [(leg, key) for leg, key in zip(self.legs, self.keys, strict=True) if leg.pace == 0.0][1:]

    @property
    def turns(self) -> bool:
        """True if a leg has its own heading."""
        return any(leg.faces or math.isfinite(leg.heading) for leg in self.legs)

    @property
    def uses_features(self) -> bool:
        """True if features matter: the vehicle turns to them, or regions of visibility move."""
        return self.turns or bool(self.views)

    @property
    def limits_speed(self) -> bool:
        """True if a leg limits the law's speed."""
        return any(leg.speed < math.inf for leg in self.legs)


def make_mission(goal: Shape, center: Vector3, motion: GoalMotion, regions: tuple[SecondaryRegion, ...]) -> Mission:
    """Make the legs of a goal, whose shape has a center [m, NED]."""
    views = {i: r.region.shape for i, r in enumerate(regions) if isinstance(r.region.shape, Visibility)}
    seen = next((shape.feature for shape in views.values()), _NOWHERE)
    first = motion.first_place
    entries = [
        msgspec.structs.replace(first, center=center),
        *(entry if isinstance(entry, GoalEntry) else GoalEntry(center=entry) for entry in motion.then),
    ]
    has_tolerance = any(entry.tolerance is not None for entry in entries)
    legs: list[Leg] = []
    stops: list[str] = []
    keys: list[str] = []
    for i, entry in enumerate(entries):
        where = f"goal.then[{i - 1}]" if i else "goal"
        if entry.tolerance is not None and not isinstance(goal, Sphere):
            raise ScenarioError(f"{where}.tolerance is {entry.tolerance} m, expected none: the goal is no sphere")
        if entry.feature is not None and not (views or entry.heading == "feature"):
            expected = "heading = 'feature' beside it, or a region of visibility"
            raise ScenarioError(f"{where}.feature is given, expected {expected}")
        stay = (motion.stay if entry.type == "place" else 0.0) if entry.stay is None else entry.stay
        radius = entry.tolerance or (goal.radius if has_tolerance and isinstance(goal, Sphere) else math.nan)
        common = Leg(center, 0, stay=stay, radius=radius, feature=entry.feature or seen)
        for name, position, leg in _legs_of(entry, common):
            is_vector = i > 0 and not isinstance(motion.then[i - 1], GoalEntry)
            keys.append(".".join(("goal", *(["then", str(i - 1)] if i else []), *([] if is_vector else [position]))))
            if leg.pace == 0.0:
                stops.append(f"place {len(stops) + 1}" + f" ({name})" * bool(name))
            legs.append(leg._replace(stop=len(stops) - 1))
            if leg.faces and math.isnan(leg.feature[0]):
                expected = f"{where}.feature, or a region of visibility"
                raise ScenarioError(f"{where}.heading is 'feature', expected {expected}")
        seen = legs[-1].feature
        if len(legs) > _MAX_LEGS:
            raise ScenarioError(f"goal.then has more than {_MAX_LEGS} pieces, expected at most as many")
    moving_views = tuple(i for i, shape in views.items() if any(leg.feature != shape.feature for leg in legs))
    for i in moving_views:
        if regions[i].moves:
            name = regions[i].region.name
            raise ScenarioError(f"regions.{name} moves, expected one at rest: the goal's features move it")
    return Mission(tuple(legs), tuple(stops), tuple(keys), moving_views)


def _legs_of(entry: GoalEntry, common: Leg) -> Iterator[tuple[str, str, Leg]]:
    """Yield each leg of an entry, with the name of its stop, and the key of its position."""
    faces = entry.heading == "feature" or (entry.type == "orbit" and entry.heading is None)
    heading = math.nan if entry.heading is None or isinstance(entry.heading, str) else float(entry.heading)
    leg = common._replace(heading=heading, faces=faces)
    if entry.center is not None and entry.type == "place":
        yield "", "center", leg._replace(center=entry.center, speed=math.inf if entry.speed is None else entry.speed)
    elif entry.type == "path":
        for i, (start, end) in enumerate(itertools.pairwise((entry.points[0], *entry.points))):
            if math.dist(start, end) > _SHORTEST:
                yield "", f"points.{i}", leg._replace(center=end, pace=entry.pace)
            yield f"point {i + 1}", f"points.{i}", leg._replace(center=end)
    elif entry.center is not None and entry.radius is not None:
        yield from _rings(entry, leg, np.array(entry.center), entry.radius)


def _rings(entry: GoalEntry, leg: Leg, center: Array, radius: float) -> Iterator[tuple[str, str, Leg]]:
    """Yield the legs of rings, and one at their end."""
    axis = np.array(entry.axis) / math.hypot(*entry.axis)
    north = np.eye(3)[0 if abs(axis[0]) < _ALONG else 1]
    aside = north - (north @ axis) * axis
    u = aside / np.linalg.norm(aside)
    v = np.cross(axis, u)
    pieces = max(1, round(_SEGMENTS * abs(entry.turns)))
    angle, last = entry.bearing, leg
    for n, along in enumerate(entry.rings):
        middle = center + along * axis
        ring = leg._replace(feature=entry.feature or _vector(middle))

        def point_at(angle: float, middle: Array = middle) -> Vector3:
            return _vector(middle + radius * (math.cos(angle) * u + math.sin(angle) * v))

        start = ring._replace(center=point_at(angle))
        if n and math.dist(last.center, start.center) > _SHORTEST:
            yield "", "center", start._replace(pace=entry.pace)
        yield f"ring {n + 1}", "center", start
        for k in range(1, pieces + 1):
            last = ring._replace(center=point_at(angle + 2.0 * math.pi * entry.turns * k / pieces), pace=entry.pace)
            yield "", "center", last
        angle += 2.0 * math.pi * entry.turns
    yield "rings done", "center", last._replace(pace=0.0)


def _vector(numbers: Array) -> Vector3:
    x, y, z = numbers.tolist()
    return x, y, z


def camera_heading(quaternion: Vector4, regions: tuple[SecondaryRegion, ...]) -> tuple[float, float]:
    """Return the headings [rad] of bow and camera at an attitude; the bow's for a camera that looks up or down."""
    R = rotation_matrix(np.array(quaternion))
    bow = math.atan2(R[1, 0], R[0, 0])
    for region in regions:
        shape = region.region.shape
        if isinstance(shape, Visibility):
            north, east, _ = R @ np.array(shape.camera_axis)
            level = math.hypot(north, east) > 0.1 * math.hypot(*shape.camera_axis)
            return bow, math.atan2(east, north) if level else bow
    return bow, bow
