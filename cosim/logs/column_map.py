"""Column maps: TOML files that assign columns or fields to quantities, with units and frames."""

from __future__ import annotations

import re
from collections.abc import Container
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from cosim.errors import ImportLogError
from cosim.logs.frames import BODIES, UNITS, WORLDS, convert_quaternions, quaternions_of_angles
from cosim.logs.quantities import QUANTITIES
from cosim.logs.spool import LogContents
from cosim.simulation.signals import Array
from plant_fmu.errors import TableError
from plant_fmu.toml_tables import Table, decode, read_toml

_ORDER = re.compile(r"[XYZ]{3}|[xyz]{3}")
_MAX_ODD = 0.1  # maximum fraction of quaternions of a length other than 1, which are treated as missing
_MAX_ANGLE = 2.0 * np.pi + 0.01  # rad
World = Literal["NED", "ENU", "NWU"]
Body = Literal["FRD", "FLU", "RFU"]


class TimeColumn(Table, frozen=True):
    """Column and unit of times."""

    column: str
    unit: Literal["s", "ms", "us", "ns", "iso8601"] = "s"


class MappedQuantity(Table, frozen=True):
    """Columns, unit and frame of a quantity."""

    columns: tuple[str, ...] = ()
    unit: str | None = None  # default: the SI unit
    topic: str = ""  # topic of the messages in a bag
    file: str = ""  # pattern of the log's name, such as *wrench*.csv; empty: the first log that has the columns
    valid: str = ""  # column that is 0 where a sample is invalid
    invalid: tuple[float, ...] = ()  # markers of invalid samples, in the unit of the columns
    min: float = -np.inf  # bounds of valid values, in the unit of the columns
    max: float = np.inf
    time: TimeColumn | None = None  # default: that of the map
    euler: str = ""  # axes of Euler angles, in the order of the columns; capital letters: rotations about body axes
    quaternion: Literal["wxyz", "xyzw"] = "wxyz"  # order of the components
    inverse: bool = False  # True if the attitude is from world to body
    sign: Literal[1, -1] = 1  # factor of the values; -1 for a depth or an altitude of the opposite direction
    world: World | None = None  # default: that of the map
    body: Body | None = None  # default: that of the map

    @property
    def needs(self) -> tuple[str, ...]:
        """Columns that hold values and their validity."""
        return (*self.columns, *([self.valid] if self.valid else []))

    def is_valid(self, values: Array, flags: Array | None) -> NDArray[np.bool_]:
        """Return True for valid samples; values (n, size) in the unit of the columns, flags (n,)."""
        valid = np.all((values >= self.min) & (values <= self.max), axis=1)
        for marker in self.invalid:
            match = np.isclose(values, marker, rtol=1e-6, atol=1e-9)
            valid &= ~(match.any(axis=1) if marker else match.all(axis=1))
        result: NDArray[np.bool_] = valid if flags is None else valid & (np.nan_to_num(flags) != 0.0)
        return result


class ColumnMap(Table, frozen=True):
    """A column map: default time and frames; `_FileMap` adds a `MappedQuantity` for each quantity."""

    time: TimeColumn | None = None
    world: World = "NED"
    body: Body = "FRD"
    messages: str = ""  # folder of .msg files, for types that a bag does not define

    @property
    def quantities(self) -> dict[str, MappedQuantity]:
        """Mapped quantities, by name."""
        entries = {name: getattr(self, name, None) for name in QUANTITIES}
        return {name: mapped for name, mapped in entries.items() if mapped is not None}

    def time_of(self, name: str) -> TimeColumn | None:
        """Return the time column of a quantity, or None if it has none."""
        mapped = self.quantities[name]
        return mapped.time or self.time

    def put(
        self, contents: LogContents, name: str, times: Array, values: Array, is_valid: NDArray[np.bool_]
    ) -> None:  # fmt: skip
        """Convert samples of a quantity from the map's unit and frame, and add them to the contents of a log."""
        # Units of arguments: times [s]
        mapped = self.quantities[name]
        source = contents.source(name, source_name(mapped), QUANTITIES[name].size or len(mapped.columns))
        source.put_many(times, self._converted(name, mapped, np.where(is_valid[:, None], values, np.nan)))

    def only(self, names: Container[str]) -> ColumnMap:
        """Return the map with some of its quantities."""
        return msgspec.structs.replace(self, **{name: None for name in self.quantities if name not in names})

    def _converted(self, name: str, mapped: MappedQuantity, values: Array) -> Array:
        quantity = QUANTITIES[name]
        world, body = mapped.world or self.world, mapped.body or self.body
        if name == "attitude":
            return _attitudes(mapped, values, world, body)
        values = mapped.sign * values * UNITS[quantity.unit][mapped.unit or quantity.unit]
        if quantity.frame:
            turn = WORLDS[world] if quantity.frame == "world" else BODIES[body]
            parts = [values[:, i : i + 3] @ turn.T for i in range(0, quantity.size, 3)]
            values = np.hstack(parts)
        return values


MAPPED = tuple(name for name in QUANTITIES if name != "pressure")  # quantities that a map may have
_FileMap = msgspec.defstruct(
    "_FileMap", [(name, MappedQuantity | None, None) for name in MAPPED], bases=(ColumnMap,), frozen=True,
    forbid_unknown_fields=True,
)  # fmt: skip


def source_name(mapped: MappedQuantity) -> str:
    """Return the name of a quantity's columns in a report."""
    shown = ", ".join(mapped.columns[:3]) + (" ..." if len(mapped.columns) > 3 else "")
    return f"{mapped.topic}: {shown}" if mapped.topic else shown


def _attitudes(mapped: MappedQuantity, values: Array, world: str, body: str) -> Array:
    known: NDArray[np.bool_] = np.asarray(np.isfinite(values).all(axis=1))
    if mapped.euler:
        angles = _wrapped(values[known] * UNITS["rad"][mapped.unit or "rad"], mapped.euler)
        _require_angles(mapped, angles)
        odd = np.abs(angles).max(axis=1, initial=0.0) > _MAX_ANGLE
        known[np.flatnonzero(known)[odd]] = False
        quaternions = quaternions_of_angles(angles[~odd], mapped.euler)
    else:
        quaternions = values[known] if mapped.quaternion == "wxyz" else values[known][:, [3, 0, 1, 2]]
        length = np.hypot.reduce(quaternions, axis=1)
        odd = np.abs(length - 1.0) > 0.05
        if odd.sum() > _MAX_ODD * len(odd):
            worst = float(length[np.argmax(np.abs(length - 1.0))])
            raise ImportLogError(
                f"{source_name(mapped)}: quaternion of length {worst:.4g}, expected 1; for angles set euler"
            )
        known[np.flatnonzero(known)[odd]] = False
        quaternions = quaternions[~odd]
    if mapped.inverse:
        quaternions = quaternions * np.array([1.0, -1.0, -1.0, -1.0])
    result = np.full((len(values), 4), np.nan)
    if known.any():
        result[known] = convert_quaternions(quaternions, world, body)
    return result


def _wrapped(angles: Array, order: str) -> Array:
    """Return angles [rad] with a continuous yaw, which filters count on beyond a turn, within half a turn."""
    yaw = [i for i, axis in enumerate(order.lower()) if axis == "z"][:1]
    counted = angles[:, yaw]
    if (
        not len(angles)
        or np.abs(counted[0]).max() > _MAX_ANGLE
        or np.abs(np.diff(counted, axis=0)).max(initial=0.0) > 1.0
    ):
        return angles
    result = angles.copy()
    result[:, yaw] = np.remainder(counted + np.pi, 2.0 * np.pi) - np.pi
    return result


def _require_angles(mapped: MappedQuantity, angles: Array) -> None:
    sizes = np.abs(angles).max(axis=1, initial=0.0)
    size = float(sizes.max(initial=0.0))
    if np.count_nonzero(sizes > _MAX_ANGLE) > _MAX_ODD * len(sizes):
        raise ImportLogError(
            f"{source_name(mapped)}: attitude reaches {size:.4g} rad, expected at most 6.293 rad: "
            'check its unit, such as unit = "deg"'
        )


def read_map(path: Path) -> ColumnMap:
    """Read a column map."""
    try:
        columns: ColumnMap = decode(read_toml(path), _FileMap)
        for name, mapped in columns.quantities.items():
            _check(name, mapped)
        if columns.messages:
            columns = msgspec.structs.replace(columns, messages=str(path.parent / columns.messages))
            if not Path(columns.messages).is_dir():
                raise TableError(f"messages is {columns.messages!r}, expected a folder of .msg files")
        if not columns.quantities:
            raise TableError("maps no quantity, expected tables such as [attitude], [depth] and [pulses]")
    except TableError as error:
        raise ImportLogError(f"{path}: {error}") from error
    return columns


def _check(name: str, mapped: MappedQuantity) -> None:
    quantity = QUANTITIES[name]
    size = 3 if mapped.euler else quantity.size
    count = len(mapped.columns)
    if size and count != size:
        more = " (or 3 with euler)" if name == "attitude" and not mapped.euler else ""
        raise TableError(f"{name}.columns has {count} names, expected {size}{more}: {quantity.what}")
    if not count:
        raise TableError(f"{name}.columns has no names, expected one for each thruster: {quantity.what}")
    if mapped.euler and (name != "attitude" or not _valid_order(mapped.euler)):
        raise TableError(
            f"{name}.euler is {mapped.euler!r}, expected three axes of an attitude such as 'ZYX' for yaw, pitch, roll"
        )
    known = UNITS["rad" if mapped.euler else quantity.unit]
    if mapped.unit is not None and mapped.unit not in known:
        raise TableError(f"{name}.unit is {mapped.unit!r}, expected one of {', '.join(map(repr, known))}")


def _valid_order(order: str) -> bool:
    return _ORDER.fullmatch(order) is not None and order[0] != order[1] and order[1] != order[2]
