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
from cosim.logs.clocks import Clock
from cosim.logs.column_map import ColumnMap
from cosim.logs.format import LogFormat, Moved
from cosim.logs.frames import quaternion_of_angles
from cosim.logs.spool import LogContents

_CHUNK = 1 << 20  # bytes that are read at once
_HEAD = b"\xa3\x95"  # first bytes of each message
_FMT, _FMT_SIZE = 0x80, 89  # type of the message FMT; its size [bytes]
_NOTHING = math.nan
_FRAMES = (  # names of ArduSub's FRAME_CONFIG, from 0
    "bluerov1", "vectored", "vectored_6dof", "vectored_6dof_90deg", "simplerov_3", "simplerov_4", "simplerov_5",
)  # fmt: skip
_OTHERS = ("ArduCopter", "ArduPlane", "ArduRover", "AntennaTracker", "Blimp")  # firmware of other vehicles
_OF_THE_LOG = {"FMT", "FMTU", "UNIT", "MULT", "PARM", "MSG", "VER"}  # messages about the log, not counted as unread

Fields = dict[str, Any]


def read(path: Path, columns: ColumnMap | None, contents: LogContents, moved: Moved) -> None:
    """Read a dataflash log, as specified by `LogFormat`; raise ImportLogError for another file."""
    contents.autopilot = "ardupilot"
    handlers = _MessageHandlers(contents)
    lost, any_message = 0, False
    for name, fields in _messages(path, handlers.wanted, moved):
        if name is None:
            lost += 1
            continue
        any_message = True
        if fields is not None:
            handlers.take(name, fields)
        elif name not in _OF_THE_LOG:
            contents.unread[name] += 1
    if not any_message:
        raise ImportLogError("holds no message, expected a dataflash log of ArduPilot")
    if lost:
        contents.remarks.append(f"{lost} bytes of the log are no messages and were passed over.")
    for _, by in handlers.clock.jumps:
        contents.remarks.append(f"The autopilot's clock jumps by {by:+.4g} s: it is taken as a pause of 1 s.")
    handlers.conclude()


class _MessageHandlers:
    """Add messages to the contents of a log."""

    def __init__(self, contents: LogContents) -> None:
        self._contents = contents
        self.clock = Clock()
        self._rate_stamp = _NOTHING
        self._handlers: dict[str, Callable[[Fields, float], None]] = {
            name.removeprefix("_on_").upper(): getattr(self, name) for name in dir(self) if name.startswith("_on_")
        }
        self.wanted = frozenset(self._handlers)

    def take(self, name: str, m: Fields) -> None:
        """Add a message with its fields."""
        if name == "RATE" and self._is_stale(m["TimeUS"] * 1e-6):
            return
        at = self.clock.time(m["TimeUS"] * 1e-6) if "TimeUS" in m else _NOTHING
        try:
            self._handlers[name](m, at)
        except KeyError as error:
            raise ImportLogError(f"message {name} has no field {error}, expected it as ArduPilot has it") from error

    def _is_stale(self, stamp: float) -> bool:
        """Return True for a RATE that repeats an old stamp [s], since the rate controller rests, as in MANUAL."""
        last, self._rate_stamp = self._rate_stamp, stamp
        return stamp == last or self.clock.is_behind(stamp)

    def conclude(self) -> None:
        """Set the preferences among several sources."""
        contents = self._contents
        primary = int(contents.parameters.get("BARO_PRIMARY", 0.0))
        instances = sorted(name for quantity, name in contents.sources if quantity == "depth")
        named = f"BARO[{primary}]"
        contents.preferences |= {
            "attitude": ("XKQ[0]", "ATT"),
            "depth": tuple(dict.fromkeys([*([named] if named in instances else []), *reversed(instances)])),
            "position": ("XKF1[0]", "POS"),
            "velocity_world": ("XKF1[0]",),
            "rates": ("RATE",),
            "gyro": ("IMU[0]", "IMU"),
            "acceleration": ("IMU[0]", "IMU"),
        }

    def _put(self, quantity: str, name: str, at: float, *values: float) -> None:
        self._contents.put(quantity, name, _NOTHING, at, values)

    # ---- handlers, one for each message, named after it ----

    def _on_parm(self, m: Fields, at: float) -> None:
        self._contents.parameters[str(m["Name"])] = float(m["Value"])
        if m["Name"] == "FRAME_CONFIG" and 0 <= m["Value"] < len(_FRAMES):
            self._contents.frame = _FRAMES[int(m["Value"])]

    def _on_msg(self, m: Fields, at: float) -> None:
        firmware = str(m["Message"]).split(" ")[0]
        if firmware in _OTHERS:
            self._contents.kind = f"vehicle of {firmware}"

    def _on_att(self, m: Fields, at: float) -> None:
        angles = [math.radians(m[name]) for name in ("Roll", "Pitch", "Yaw")]
        self._put("attitude", "ATT", at, *quaternion_of_angles(*angles))

    def _on_xkq(self, m: Fields, at: float) -> None:
        q = [m[f"Q{i}"] for i in range(1, 5)]
        length = math.hypot(*q)
        self._put("attitude", f"XKQ[{m.get('C', 0)}]", at, *(part / length if length else _NOTHING for part in q))

    def _on_xkf1(self, m: Fields, at: float) -> None:
        name = f"XKF1[{m.get('C', 0)}]"
        self._put("position", name, at, m["PN"], m["PE"], m["PD"])
        self._put("velocity_world", name, at, m["VN"], m["VE"], m["VD"])

    def _on_rate(self, m: Fields, at: float) -> None:
        self._put("rates", "RATE", at, *(math.radians(m[name]) for name in "RPY"))

    def _on_imu(self, m: Fields, at: float) -> None:
        name = f"IMU[{m['I']}]" if "I" in m else "IMU"
        self._put("gyro", name, at, m["GyrX"], m["GyrY"], m["GyrZ"])
        self._put("acceleration", name, at, m["AccX"], m["AccY"], m["AccZ"])

    def _on_baro(self, m: Fields, at: float) -> None:
        self._put("depth", f"BARO[{m['I']}]" if "I" in m else "BARO", at, -m["Alt"])

    def _on_rfnd(self, m: Fields, at: float) -> None:
        if m.get("Orient", 25) == 25:  # looking down
            self._put("altitude", "RFND", at, m["Dist"])
        else:
            self._contents.unread[f"RFND of orientation {m['Orient']}"] += 1

    def _on_viso(self, m: Fields, at: float) -> None:
        if m["dt"] > 0.0:  # the mean over dt, which ends at the stamp
            self._put("dvl", "VISO", at - 0.5 * m["dt"], *(m[f"PosD{axis}"] / m["dt"] for axis in "XYZ"))

    def _on_rcou(self, m: Fields, at: float) -> None:
        self._put("pulses", "RCOU", at, *(float(m[f"C{i}"]) for i in range(1, 33) if f"C{i}" in m))

    def _on_bat(self, m: Fields, at: float) -> None:
        if m.get("Inst", m.get("Instance", 0)) == 0:
            self._put("voltage", "BAT", at, m["Volt"])


def _messages(path: Path, wanted: frozenset[str], moved: Moved) -> Iterator[tuple[str | None, Fields | None]]:
    """Yield name and fields of each message, None for fields of unwanted ones; None and None for an invalid byte."""
    formats: dict[int, tuple[DFFormat, struct.Struct]] = {}
    first = DFFormat(_FMT, "FMT", _FMT_SIZE, "BBnNZ", "Type,Length,Name,Format,Columns")
    formats[_FMT] = first, struct.Struct(first.msg_struct)
    total = max(1, path.stat().st_size)
    with path.open("rb") as file:
        data, at, done, ended = b"", 0, 0, False
        while True:
            if len(data) - at < 512 and not ended:
                more = file.read(_CHUNK)
                ended, done = not more, done + len(more)
                data, at = data[at:] + more, 0
                moved(done / total)
            if len(data) - at < 3:
                return
            form, unpack = formats.get(data[at + 2], (None, None)) if data[at : at + 2] == _HEAD else (None, None)
            if form is None or unpack is None or at + form.len > len(data):
                yield None, None
                at += 1
                continue
            name = form.name
            body = data[at + 3 : at + form.len]
            at += form.len
            if name == "FMT":
                _learn(unpack.unpack(body), formats)
            if name in wanted:
                yield name, _fields(form, unpack.unpack(body))
            else:
                yield name, None


def _learn(fields: tuple[Any, ...], formats: dict[int, tuple[DFFormat, struct.Struct]]) -> None:
    kind, size, *texts = fields
    name, letters, columns = (text.split(b"\0")[0].decode("ascii", "replace") for text in texts)
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
    made: Fields = {}
    for column, value, scale in zip(form.columns, values, form.msg_mults, strict=True):
        if isinstance(value, bytes):
            made[column] = value.split(b"\0")[0].decode("ascii", "replace")
        else:
            made[column] = value * scale if scale is not None else value
    return made


FORMAT = LogFormat((".bin",), read)
