"""Dataflash logs of ArduPilot: messages whose formats are in the log."""

from __future__ import annotations

import contextlib
import io
import math
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from pymavlink.DFReader import DFFormat

from cosim.errors import ImportLogError
from cosim.logs.chunked_file import ChunkedFile, OnProgress
from cosim.logs.clocks import Clock
from cosim.logs.column_map import ColumnMap
from cosim.logs.frames import quaternion_of_angles, unit_quaternion
from cosim.logs.spool import LogContents
from cosim.logs.vehicle_messages import DOWNWARD

_HEAD = b"\xa3\x95"  # first bytes of each message
_FMT, _FMT_SIZE = 0x80, 89  # type of the message FMT; its size [bytes]
_MAX_MESSAGE = 512  # bytes
_FRAMES = (  # names of ArduSub's FRAME_CONFIG, from 0
    "bluerov1", "vectored", "vectored_6dof", "vectored_6dof_90deg", "simplerov_3", "simplerov_4", "simplerov_5",
)  # fmt: skip
_OTHERS = ("ArduCopter", "ArduPlane", "ArduRover", "AntennaTracker", "Blimp")  # firmware of other vehicles
_ABOUT_LOG = {"FMT", "FMTU", "UNIT", "MULT", "PARM", "MSG", "VER"}  # messages that are not counted as unread
_SAMPLES = {  # message: the quantities that it holds, with their fields and the factor to SI units
    "XKF1": (("position", "PN PE PD", 1.0), ("velocity_world", "VN VE VD", 1.0)),
    "RATE": (("rates", "R P Y", math.pi / 180.0),),
    "IMU": (("gyro", "GyrX GyrY GyrZ", 1.0), ("acceleration", "AccX AccY AccZ", 1.0)),
    "BARO": (("depth", "Alt", -1.0),),
    "RFND": (("altitude", "Dist", 1.0),),
    "BAT": (("voltage", "Volt", 1.0),),
}

Fields = dict[str, Any]


def read(path: Path, columns: ColumnMap | None, contents: LogContents, on_progress: OnProgress) -> None:
    """Read a dataflash log, as specified by `LogFormat`; raise ImportLogError for another file."""
    contents.autopilot = "ardupilot"
    messages = _Messages(contents)
    lost, any_message = 0, False
    for name, fields in parse_messages(path, messages.names, on_progress):
        if name is None:
            lost += 1
            continue
        any_message = True
        if fields is not None:
            messages.add(name, fields)
        elif name not in _ABOUT_LOG:
            contents.unread[name] += 1
    if not any_message:
        raise ImportLogError("holds no message, expected a dataflash log of ArduPilot")
    if lost:
        contents.remarks.append(f"{lost} bytes of the log are no messages and were passed over.")
    contents.remarks += messages.clock.remarks("The autopilot's clock")
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


class _Messages:
    """Add messages to the contents of a log."""

    def __init__(self, contents: LogContents) -> None:
        self._contents = contents
        self.clock = Clock()
        self._rate_stamp = math.nan
        self._handlers: dict[str, Callable[[Fields, str, float], None]] = {
            "PARM": self._store_parameter, "MSG": self._store_kind, "ATT": self._put_angles,
            "XKQ": self._put_quaternion, "VISO": self._put_dvl, "RCOU": self._put_pulses,
        }  # fmt: skip
        self.names = frozenset(self._handlers) | _SAMPLES.keys()

    def add(self, name: str, m: Fields) -> None:
        """Add a message of `names` with its fields."""
        try:
            self._add(name, m)
        except KeyError as error:
            raise ImportLogError(f"message {name} has no field {error}, expected it as ArduPilot has it") from error
        except (TypeError, ValueError) as error:
            raise ImportLogError(f"message {name} has a text, expected numbers as ArduPilot has them") from error

    def _add(self, name: str, m: Fields) -> None:
        stamp = m.get("TimeUS", math.nan) * 1e-6
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
        for quantity, fields, factor in _SAMPLES.get(name, ()):
            self._put(quantity, source, time, *(factor * m[field] for field in fields.split()))
        if name in self._handlers:
            self._handlers[name](m, source, time)

    def _is_stale(self, stamp: float) -> bool:
        """Return True for a RATE that repeats an old stamp [s], since the rate controller rests, as in MANUAL."""
        last, self._rate_stamp = self._rate_stamp, stamp
        return stamp == last or self.clock.is_behind(stamp)

    def _put(self, quantity: str, source: str, time: float, *values: float) -> None:
        self._contents.put(quantity, source, math.nan, time, values)

    # ---- messages that are no plain samples ----

    def _store_parameter(self, m: Fields, source: str, time: float) -> None:
        self._contents.put_parameter(str(m["Name"]), float(m["Value"]))
        if m["Name"] == "FRAME_CONFIG" and 0 <= m["Value"] < len(_FRAMES):
            self._contents.frame = _FRAMES[int(m["Value"])]

    def _store_kind(self, m: Fields, source: str, time: float) -> None:
        firmware = str(m["Message"]).split(" ")[0]
        if firmware in _OTHERS:
            self._contents.kind = f"vehicle of {firmware}"

    def _put_angles(self, m: Fields, source: str, time: float) -> None:
        angles = (math.radians(m[name]) for name in ("Roll", "Pitch", "Yaw"))
        self._put("attitude", source, time, *quaternion_of_angles(*angles))

    def _put_quaternion(self, m: Fields, source: str, time: float) -> None:
        self._put("attitude", source, time, *unit_quaternion([m[f"Q{i}"] for i in range(1, 5)]))

    def _put_dvl(self, m: Fields, source: str, time: float) -> None:
        if m["dt"] > 0.0:  # the mean over dt, which ends at the stamp
            self._put("dvl", source, time - 0.5 * m["dt"], *(m[f"PosD{axis}"] / m["dt"] for axis in "XYZ"))

    def _put_pulses(self, m: Fields, source: str, time: float) -> None:
        self._put("pulses", source, time, *(float(m[f"C{i}"]) for i in range(1, 33) if f"C{i}" in m))


def parse_messages(
    path: Path, names: frozenset[str], on_progress: OnProgress
) -> Iterator[tuple[str | None, Fields | None]]:
    """Yield name and fields of each message, None for fields of other names; None and None for an invalid byte."""
    formats: dict[int, tuple[DFFormat, struct.Struct]] = {}
    first = DFFormat(_FMT, "FMT", _FMT_SIZE, "BBnNZ", "Type,Length,Name,Format,Columns")
    formats[_FMT] = first, struct.Struct(first.msg_struct)
    with ChunkedFile(path, on_progress) as file:
        while (ahead := file.ahead(_MAX_MESSAGE)) >= 3:
            data, offset = file.data, file.offset
            form, unpack = formats.get(data[offset + 2], (None, None))
            if form is None or unpack is None or data[offset : offset + 2] != _HEAD or form.len > ahead:
                yield None, None
                file.offset += 1
                continue
            file.offset += form.len
            is_read = form.name in names
            values = unpack.unpack(data[offset + 3 : file.offset]) if is_read or form.name == "FMT" else ()
            if form.name == "FMT":
                _learn(values, formats)
            yield form.name, _fields(form, values) if is_read else None


def _learn(fields: tuple[Any, ...], formats: dict[int, tuple[DFFormat, struct.Struct]]) -> None:
    kind, size, *texts = fields
    name, letters, columns = map(_text, texts)
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # pymavlink prints an unknown letter
            form = DFFormat(kind, name, size, letters, columns)
        unpack = struct.Struct(form.msg_struct)
    except Exception as error:
        raise ImportLogError(f"message {name!r} has the format {letters!r}, which is unknown") from error
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
