"""Telemetry logs of ground stations: MAVLink frames, each after its time of reception."""

from __future__ import annotations

import re
import struct
from pathlib import Path

from cosim.errors import ImportLogError
from cosim.logs.cleaning.clocks import Clock
from cosim.logs.column_map import ColumnMap
from cosim.logs.records import OnProgress, Records
from cosim.logs.spool import LogContents
from cosim.logs.vehicle_messages import AUTOPILOT, MESSAGES, NO_AUTOPILOT, VehicleMessages
from cosim.mavlink.wire.dialect import dialect
from cosim.mavlink.wire.framing import FrameFilter, Header, RxStats, parse_header

_STAMP = struct.Struct(">Q")  # us since 1970
_EARLIEST, _LATEST = 9e8, 4.1e9  # s since 1970, range of stamps of frames whose checksum is unknown
_HEARTBEAT = 0  # message id


def read(path: Path, columns: ColumnMap | None, contents: LogContents, on_progress: OnProgress) -> None:
    """Read a telemetry log, as specified by `LogFormat`; raise ImportLogError if it has no vehicle."""
    frames, clock, infos = FrameFilter(RxStats()), Clock(), dialect().mavlink_map
    messages = VehicleMessages(contents, *_find_vehicle(path))
    records = _Frames(path, on_progress)
    for stamp, frame, header in records:
        written = clock.time(stamp)
        info = infos.get(header.message_id)
        if info is None or info.msgname not in MESSAGES:
            if header.message_id != _HEARTBEAT:
                contents.unread[info.msgname if info else f"message {header.message_id}"] += 1
            continue
        for _, message in frames.accept(frame, header):
            messages.add(header.system, header.component, message, written)
    contents.remarks += [*records.remarks(path.name), *clock.remarks("The clock of the log's writer")]


def _find_vehicle(path: Path) -> tuple[int, int, int]:
    """Return system id, MAV_AUTOPILOT and MAV_TYPE of the first autopilot's heartbeat."""
    frames = FrameFilter(RxStats())
    for _, frame, header in _Frames(path):
        if (header.message_id, header.component) == (_HEARTBEAT, AUTOPILOT):
            for _, message in frames.accept(frame, header):
                if message.autopilot != NO_AUTOPILOT:
                    return header.system, message.autopilot, message.type
    raise ImportLogError("holds no heartbeat of an autopilot, expected a telemetry log of a vehicle")


class _Frames(Records[tuple[float, bytes, Header]]):
    """Reception time [s since 1970], frame and header of each frame."""

    mark = re.compile(rb"[\0-\xff]{8}[\xfd\xfe]")
    checked = mark
    head = _STAMP.size + 10

    def __init__(self, path: Path, on_progress: OnProgress = lambda fraction: None) -> None:
        super().__init__(path, on_progress)
        self._frames = FrameFilter(RxStats())

    def _size_at(self, data: bytes, offset: int) -> int:
        header = parse_header(data, offset + _STAMP.size)
        stamp = _STAMP.unpack_from(data, offset)[0] * 1e-6
        return _STAMP.size + header.size if header is not None and stamp < _LATEST else 0

    def _parse(self, record: bytes) -> tuple[float, bytes, Header]:
        header, stamp = parse_header(record, _STAMP.size), _STAMP.unpack_from(record)[0] * 1e-6
        frame = record[_STAMP.size :]
        assert header is not None
        is_checked = header.message_id in self._frames.infos  # a station without a set clock writes stamps of 1970
        if not (self._frames.is_intact(frame, header) if is_checked else stamp > _EARLIEST):
            raise ValueError
        return stamp, frame, header
