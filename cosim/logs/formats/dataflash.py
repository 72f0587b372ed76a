"""Dataflash logs of ArduPilot: messages whose formats are in the log."""

from __future__ import annotations

import contextlib
import io
import math
import re
import struct
from pathlib import Path
from typing import Any

from pymavlink.DFReader import DFFormat

from cosim.errors import ImportLogError
from cosim.logs.cleaning.clocks import Clock
from cosim.logs.column_map import ColumnMap
from cosim.logs.frames import ReadComponents, attitude_of_angles, attitude_of_quaternion, scale_fields
from cosim.logs.records import OnProgress, Records
from cosim.logs.spool import LogContents, handled_names
from cosim.logs.vehicle_messages import DOWNWARD

_HEAD = b"\xa3\x95"  # first bytes of each message
_FMT, _FMT_SIZE = 0x80, 89  # type of the message FMT; its size [bytes]
_NAMES = re.compile(r"[A-Za-z0-9_, ]+")  # of a message and its fields
_MIN_MARKS = 10  # first bytes of messages in a log of which no message can be read
_FRAMES = (  # names of ArduSub's FRAME_CONFIG, from 0
    "bluerov1", "vectored", "vectored_6dof", "vectored_6dof_90deg", "simplerov_3", "simplerov_4", "simplerov_5",
)  # fmt: skip
# firmware of other vehicles, as it has named itself since 2018 and before
_OTHERS = re.compile(r"(?:Ardu|APM:)(Copter|Plane|Rover)|(AntennaTracker|Blimp)")
_ABOUT_LOG = {"FMT", "FMTU", "UNIT", "MULT", "PARM", "MSG", "VER"}  # messages that are not counted as unread
_SAMPLES: dict[str, tuple[tuple[str, ReadComponents], ...]] = {  # message: quantities in SI units, by its fields
    "ATT": (("attitude", attitude_of_angles("Roll Pitch Yaw", math.pi / 180.0)),),
    "XKQ": (("attitude", attitude_of_quaternion("Q1 Q2 Q3 Q4")),),
    "XKF1": (("position", scale_fields("PN PE PD")), ("velocity_world", scale_fields("VN VE VD"))),
    "RATE": (("rates", scale_fields("R P Y", math.pi / 180.0)),),
    "IMU": (("gyro", scale_fields("GyrX GyrY GyrZ")), ("acceleration", scale_fields("AccX AccY AccZ"))),
    "BARO": (("depth", scale_fields("Alt", -1.0)),),
    "RFND": (("altitude", scale_fields("Dist")),),
    "BAT": (("voltage", scale_fields("Volt")),),
}

Fields = dict[str, Any]


def read(path: Path, columns: ColumnMap | None, contents: LogContents, on_progress: OnProgress) -> None:
    """Read a dataflash log, as specified by `LogFormat`; raise ImportLogError for another file."""
    contents.autopilot = "ardupilot"
    samples, messages, any_message = _Samples(contents), Messages(path, _READ, on_progress), False
    for name, fields in messages:
        any_message = True
        if fields is not None:
            samples.add(name, fields)
        elif name not in _ABOUT_LOG:
            contents.unread[name] += 1
    if not any_message:
        with path.open("rb") as file:
            marks = file.read(1 << 20).count(_HEAD)
        if marks > _MIN_MARKS:
            raise ImportLogError("has no message FMT, which defines the others: the beginning of the log is missing")
        raise ImportLogError("holds no message, expected a dataflash log of ArduPilot")
    contents.remarks += [*messages.remarks(path.name), *samples.clock.remarks("The autopilot's clock")]
    contents.preferences |= {
        "attitude": ("XKQ[0]", "ATT"),
        "depth": _preferred_barometers(contents),
        "position": ("XKF1[0]", "POS"),
        "velocity_world": ("XKF1[0]",),
        "rates": ("RATE",),
        "gyro": ("IMU[0]", "IMU"),
        "acceleration": ("IMU[0]", "IMU"),
    }


def _preferred_barometers(contents: LogContents) -> tuple[str, ...]:
    """Return the sources of depth: the primary barometer, then the last one, which is external on ArduSub."""
    instances = sorted((name for quantity, name in contents.sources if quantity == "depth"), reverse=True)
    primary = f"BARO[{int(contents.parameters.get('BARO_PRIMARY', 0.0))}]"
    return tuple(sorted(instances, key=lambda name: name != primary))


class _Samples:
    """Add messages to the contents of a log; ``_read_x`` converts messages X by hand."""

    def __init__(self, contents: LogContents) -> None:
        self._contents = contents
        self.clock = Clock()
        self._rate_stamp = math.nan

    def add(self, name: str, m: Fields) -> None:
        """Add a message that the reader converts, with its fields."""
        try:
            self._add(name, m)
        except KeyError as error:
            raise ImportLogError(f"message {name} has no field {error}, expected it as ArduPilot has it") from error
        except (TypeError, ValueError) as error:  # arithmetic with a text; ValueError by float() of PARM's value
            raise ImportLogError(f"message {name} has a text, expected numbers as ArduPilot has them") from error

    def _add(self, name: str, m: Fields) -> None:
        stamp = m["TimeUS"] * 1e-6 if "TimeUS" in m else m.get("TimeMS", math.nan) * 1e-3  # before 2015
        if name == "RATE" and self._is_stale(stamp):
            return
        time = self.clock.time(stamp)
        if name == "RFND" and m.get("Orient", DOWNWARD) != DOWNWARD:
            self._contents.unread[f"RFND of orientation {m['Orient']}"] += 1
            return
        if name == "BAT" and m.get("Inst", m.get("Instance", 0)) != 0:
            return
        instance = m.get("C", m.get("I"))
        source = name if instance is None else f"{name}[{instance}]"
        for quantity, components in _SAMPLES.get(name, ()):
            self._contents.put(quantity, source, math.nan, time, components(m.__getitem__))
        if (read := getattr(self, f"_read_{name.lower()}", None)) is not None:
            read(m, source, time)

    def _read_parm(self, m: Fields, source: str, time: float) -> None:
        self._contents.put_parameter(str(m["Name"]), float(m["Value"]))
        if m["Name"] == "FRAME_CONFIG" and 0 <= m["Value"] < len(_FRAMES):
            self._contents.frame = _FRAMES[int(m["Value"])]

    def _read_msg(self, m: Fields, source: str, time: float) -> None:
        if firmware := _OTHERS.match(str(m["Message"])):
            self._contents.kind = f"vehicle of {firmware[0]}"

    def _read_viso(self, m: Fields, source: str, time: float) -> None:
        if m["dt"] > 0.0:  # the mean over dt, which ends at the stamp
            velocity = [m[f"PosD{axis}"] / m["dt"] for axis in "XYZ"]
            self._contents.put("dvl", source, math.nan, time - 0.5 * m["dt"], velocity)

    def _read_rcou(self, m: Fields, source: str, time: float) -> None:
        pulses = [float(m[f"C{i}"]) for i in range(1, 33) if f"C{i}" in m]
        self._contents.put("pulses", source, math.nan, time, pulses)

    def _is_stale(self, stamp: float) -> bool:
        """Return True for a RATE that repeats an old stamp [s], since the rate controller rests, as in MANUAL."""
        last, self._rate_stamp = self._rate_stamp, stamp
        return stamp == last or self.clock.is_behind(stamp)


_READ = frozenset(_SAMPLES) | handled_names(_Samples)


class Messages(Records[tuple[str, Fields | None]]):
    """Name and fields of each message, None for fields of messages that are not among `names`."""

    mark = re.compile(re.escape(_HEAD))
    checked = re.compile(re.escape(_HEAD + bytes([_FMT])))  # of which sizes and names must agree
    head = 3

    def __init__(self, path: Path, names: frozenset[str], on_progress: OnProgress = lambda fraction: None) -> None:
        super().__init__(path, on_progress)
        self._names = names
        first = DFFormat(_FMT, "FMT", _FMT_SIZE, "BBnNZ", "Type,Length,Name,Format,Columns")
        self._formats: dict[int, tuple[DFFormat, struct.Struct]] = {_FMT: (first, struct.Struct(first.msg_struct))}

    def _size_at(self, data: bytes, offset: int) -> int:
        form, _ = self._formats.get(data[offset + 2], (None, None))
        return form.len if form is not None and data.startswith(_HEAD, offset) else 0

    def _parse(self, record: bytes) -> tuple[str, Fields | None]:
        form, unpack = self._formats[record[2]]
        if form.name == "FMT":
            try:
                _learn(unpack.unpack_from(record, 3), self._formats)
            except ImportLogError as error:
                if len(self._formats) == 1:
                    raise
                raise ValueError from error  # damage: others are known
        return form.name, _fields(form, unpack.unpack_from(record, 3)) if form.name in self._names else None


def _learn(fields: tuple[Any, ...], formats: dict[int, tuple[DFFormat, struct.Struct]]) -> None:
    kind, size, *texts = fields
    name, letters, columns = map(_text, texts)
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # pymavlink prints an unknown letter
            form = DFFormat(kind, name, size, letters, columns)
        unpack = struct.Struct(form.msg_struct)
    except Exception as error:
        raise ImportLogError(f"message {name!r} has the format {letters!r}, which is unknown") from error
    if not _NAMES.fullmatch(f"{name},{columns}"):
        raise ImportLogError(f"message {name!r} has fields {columns!r}, expected names")
    if unpack.size != size - 3 or len(form.columns) != len(letters):
        raise ImportLogError(f"message {name!r} has {size} bytes, expected {unpack.size + 3} by its format {letters!r}")
    formats[kind] = form, unpack


def _fields(form: DFFormat, values: tuple[Any, ...]) -> Fields:
    return {
        column: _text(value) if isinstance(value, bytes) else value if scale is None else value * scale
        for column, value, scale in zip(form.columns, values, form.msg_mults, strict=True)
    }


def _text(value: bytes) -> str:
    return value.split(b"\0")[0].decode("ascii", "replace")
