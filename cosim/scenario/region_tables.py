"""The tables of a scenario's goal, regions, shapes and criteria; and a secondary region with its criterion."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_type_hints

import msgspec

from controller.errors import RegionError
from controller.regions import Region
from controller.regions.region_set import deviations_of
from controller.regions.shape import Shape
from controller.regions.shapes import ENTRIES
from plant_fmu.toml_tables import Finite, NonNegative, Table, key, require

Vector3 = tuple[Finite, Finite, Finite]
Vector4 = tuple[Finite, Finite, Finite, Finite]
Vector6 = tuple[Finite, Finite, Finite, Finite, Finite, Finite]
PARKED_POSITION: Vector3 = (0.0, 0.0, -1e5)  # m, NED: position of free obstacle slots


class CriterionEntry(Table, frozen=True):
    """A criterion for which regions are weighed."""

    name: Annotated[
        str,
        key(
            "unique name: a letter, then at most 23 letters, digits and _",
            pattern=r"\A[A-Za-z][A-Za-z0-9_]{0,23}\Z",  # valid in column names, and as a variable in all rule formats
            expected="a letter, then at most 23 letters, digits and _, no word of rules",
        ),
    ]
    order: Annotated[int | None, key("priority: the lowest comes first", default="its position in the list")] = None
    color: Annotated[
        str,
        key(
            "color in figures and pages, `#RRGGBB`", default="one that no other has",
            pattern=r"\A(#[0-9A-Fa-f]{6})?\Z", expected="#RRGGBB",
        ),
    ] = ""  # fmt: skip
    membership: Annotated[
        dict[str, Any],
        key(
            "memberships by `ramp`, `clearance`, `angle`, `approach_time`; the maximum counts",
            default="`arbiter.ramp`",
        ),
    ] = msgspec.field(default_factory=dict)


# section VI of the paper; the colors are Okabe and Ito's, which are safe for color blindness
PAPER_CRITERIA = (
    CriterionEntry("obstacle", 1, "#D55E00"),
    CriterionEntry("shape", 2, "#E69F00"),
    CriterionEntry("depth", 3, "#56B4E9"),
)


class ShapeTable(Table, frozen=True, tag_field="type", omit_defaults=True):
    """Base of the table of each shape."""

    def __post_init__(self) -> None:
        try:
            self.shape.bounds()  # reads the file of a shape that has one
        except RegionError as error:
            name, _, rest = str(error).partition(": ")
            is_file = name.endswith(str(getattr(self, "file", None)))
            raise ValueError(str(error) if is_file else rest) from error

    @property
    def shape(self) -> Shape:
        """The shape itself."""
        values = {name: getattr(self, name) for name in self.__struct_fields__}
        return ENTRIES[str(self.__struct_config__.tag)].shape(**values)


def _shape_table(kind: str) -> type[ShapeTable]:
    shape = ENTRIES[kind].shape
    hints = get_type_hints(shape)
    fields = [
        (name, hints[name], getattr(shape, name)) if hasattr(shape, name) else (name, hints[name])
        for name in ENTRIES[kind].units
    ]
    fields.sort(key=len)  # required ones first
    return msgspec.defstruct(shape.__name__, fields, bases=(ShapeTable,), frozen=True, tag=kind)  # type: ignore[return-value]


if TYPE_CHECKING:
    AnyShape = ShapeTable
else:
    AnyShape = Union[tuple(_shape_table(kind) for kind in ENTRIES)]  # noqa: UP007


class RegionEntry(Table, frozen=True):
    """A secondary region; the keys of its shape depend on the shape."""

    name: Annotated[
        str,
        key(
            "unique name: letters, digits, blanks, - and _",
            pattern=r"\A(?!goal\Z)[A-Za-z0-9][A-Za-z0-9 _-]{0,39}\Z",  # valid in column names and labels of figures
            expected="at most 40 letters, digits, blanks, - and _, and not goal",
        ),
    ]
    criterion: Annotated[str, key("name of the criterion", more=" whose weight multiplies the gain")]
    keep: Annotated[Literal["in", "out"], key("`in` or `out`")]
    gain: Annotated[NonNegative, key("alpha of section VII")]
    shape: Annotated[AnyShape, key("a shape", more=", below")]
    velocity: Annotated[Vector3, key("velocity, north east down; the law receives it", "m/s")] = (0.0, 0.0, 0.0)
    streamed: Annotated[bool, key("moved from outside during the run", more=", below")] = False
    hard: Annotated[
        bool,
        key(
            "true: the vehicle must not violate it; false: it only pushes",
            more="; the paper's law and laws of plain potentials do not use it",
        ),
    ] = True
    deviation: Annotated[
        float | tuple[float, float, float],  # with a range msgspec would read foreign memory
        key(
            "standard deviation of its position, or three: north, east, down", "m",
            ": margins of the deployable law grow",
        ),
    ] = 0.0  # fmt: skip
    priority: Annotated[
        NonNegative,
        key("factor of its violation in the score", more=" `weighted_violation`; neither arbiter nor law receives it"),
    ] = 1.0

    def __post_init__(self) -> None:
        ok = all(0.0 <= deviation < math.inf for deviation in deviations_of(self.deviation))
        require(ok, "deviation", self.deviation, "finite, 0 m or above, one number or three")


@dataclass(frozen=True)
class SecondaryRegion:
    """A region and its criterion."""

    region: Region
    criterion: str  # name of a criterion of the scenario
    streamed: bool = False  # True: moved from outside during the run
    is_dynamic: bool = False  # slot for an obstacle that commands may add during the run
    priority: float = 1.0  # factor of its violation in the score

    @property
    def moves(self) -> bool:
        """True if it may move away from its position in the scenario."""
        return self.streamed or any(self.region.velocity)
