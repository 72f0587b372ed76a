"""Telemetry logs of ground stations: MAVLink frames, each after its time of reception."""

from __future__ import annotations

import contextlib
import struct
from collections.abc import Iterator
from pathlib import Path

from cosim.errors import ImportLogError
from cosim.logs.chunked_file import ChunkedFile, OnProgress
from cosim.logs.cleaning.clocks import Clock
from cosim.logs.column_map import ColumnMap
from cosim.logs.spool import LogContents
from cosim.logs.vehicle_messages import AUTOPILOT, MESSAGES, NO_AUTOPILOT, VehicleMessages
from cosim.mavlink.wire.dialect import dialect
from cosim.mavlink.wire.framing import FrameFilter, Header, RxStats, parse_header

_STAMP = struct.Struct(">Q")  # us since 1970
_MAX_FRAME = 300  # bytes, bound of a stamp with its frame
_MIN_FRAME = _STAMP.size + 8  # bytes
_EARLIEST, _LATEST = 9e8, 4.1e9  # s since 1970, range of stamps of frames whose checksum is unknown
_HEARTBEAT = 0  # message id


def read(path: Path, columns: ColumnMap | None, contents: LogContents, on_progress: OnProgress) -> None:
    """Read a telemetry log, as specified by `LogFormat`; raise ImportLogError if it has no vehicle."""
    frames, clock, infos = FrameFilter(RxStats()), Clock(), dialect().mavlink_map
    messages = VehicleMessages(contents, *_find_vehicle(path))
    lost = 0
    for stamp, frame, header in _frames(path, on_progress):
        if header is None:
            lost += len(frame)
            continue
        written = clock.time(stamp)
        info = infos.get(header.message_id)
        if info is None or info.msgname not in MESSAGES:
            if header.message_id != _HEARTBEAT:
                contents.unread[info.msgname if info else f"message {header.message_id}"] += 1
            continue
        for _, message in frames.accept(frame, header):
            messages.add(header.system, header.component, message, written)
    if lost:
        contents.remarks.append(f"{lost} bytes of the log are no MAVLink frames and were passed over.")
    contents.remarks += clock.remarks("The clock of the log's writer")


def _find_vehicle(path: Path) -> tuple[int, int, int]:
    """Return system id, MAV_AUTOPILOT and MAV_TYPE of the first autopilot's heartbeat."""
    frames = FrameFilter(RxStats())
    for _, frame, header in _frames(path, lambda fraction: None):
        if header is not None and (header.message_id, header.component) == (_HEARTBEAT, AUTOPILOT):
            for _, message in frames.accept(frame, header):
                if message.autopilot != NO_AUTOPILOT:
                    return header.system, message.autopilot, message.type
    raise ImportLogError("holds no heartbeat of an autopilot, expected a telemetry log of a vehicle")


def _frames(path: Path, on_progress: OnProgress) -> Iterator[tuple[float, bytes, Header | None]]:
    """Yield reception time [s since 1970], frame and header of each frame; None as header for invalid bytes."""
    frames = FrameFilter(RxStats())
    with contextlib.closing(ChunkedFile(path, on_progress)) as file:
        while (ahead := file.ahead(_MAX_FRAME)) >= _MIN_FRAME:
            data, first = file.data, file.offset + _STAMP.size
            header = parse_header(data, first) if data[first] in (0xFE, 0xFD) else None
            stamp = _STAMP.unpack_from(data, file.offset)[0] * 1e-6
            if header is not None and _STAMP.size + header.size <= ahead and stamp < _LATEST:
                frame = data[first : first + header.size]
                is_checked = header.message_id in frames.infos  # a station without a set clock writes stamps of 1970
                if frames.is_intact(frame, header) if is_checked else stamp > _EARLIEST:
                    yield stamp, frame, header
                    file.offset = first + header.size
                    continue
            yield 0.0, data[file.offset : file.offset + 1], None
            file.offset += 1
        if ahead:
            yield 0.0, file.data[file.offset :], None
