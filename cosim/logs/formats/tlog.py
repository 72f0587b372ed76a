"""Telemetry logs of ground stations: MAVLink frames, each after its time of reception."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

from cosim.errors import ImportLogError
from cosim.logs.clocks import Clock
from cosim.logs.column_map import ColumnMap
from cosim.logs.format import LogFormat, Moved
from cosim.logs.spool import LogContents
from cosim.logs.vehicle_messages import AUTOPILOT, NO_AUTOPILOT, VehicleMessages
from cosim.mavlink.wire.dialect import dialect
from cosim.mavlink.wire.framing import FrameFilter, Header, RxStats, parse_header

_CHUNK = 1 << 20  # bytes that are read at once
_STAMP = struct.Struct(">Q")  # us since 1970
_LONGEST_FRAME = 300  # bytes, bound of a stamp with its frame
_EARLIEST, _LATEST = 9e8, 4.1e9  # s since 1970, range of valid stamps
_HEARTBEAT = 0  # message id


def read(path: Path, columns: ColumnMap | None, contents: LogContents, moved: Moved) -> None:
    """Read a telemetry log, as specified by `LogFormat`; raise ImportLogError if it has no vehicle."""
    counts, clock = RxStats(), Clock()
    frames, vehicle, kinds = FrameFilter(counts), VehicleMessages(contents, *_find_vehicle(path)), dialect().mavlink_map
    lost = 0
    for said, frame, header in _frames(path, moved):
        if header is None:
            lost += len(frame)
            continue
        written = clock.time(said)
        kind = kinds.get(header.message_id)
        if kind is None or kind.msgname not in vehicle.wanted:
            if header.message_id != _HEARTBEAT:
                contents.unread[kind.msgname if kind else f"message {header.message_id}"] += 1
            continue
        for _, message in frames.accept(frame, header):
            vehicle.take(header.system, header.component, message, written)
    if lost:
        contents.remarks.append(f"{lost} bytes of the log are no MAVLink frames and were passed over.")
    contents.remarks += clock.remarks("the log's writer")


def _find_vehicle(path: Path) -> tuple[int, int, int]:
    """Return system id, MAV_AUTOPILOT and MAV_TYPE of the first autopilot's heartbeat."""
    frames = FrameFilter(RxStats())
    for _, frame, header in _frames(path, lambda part: None):
        if header is not None and (header.message_id, header.component) == (_HEARTBEAT, AUTOPILOT):
            for _, message in frames.accept(frame, header):
                if message.autopilot != NO_AUTOPILOT:
                    return header.system, message.autopilot, message.type
    raise ImportLogError("holds no heartbeat of an autopilot, expected a telemetry log of a vehicle")


def _frames(path: Path, moved: Moved) -> Iterator[tuple[float, bytes, Header | None]]:
    """Yield reception time [s since 1970], frame and header of each frame; None as header for invalid bytes."""
    frames = FrameFilter(RxStats())
    total = max(1, path.stat().st_size)
    with path.open("rb") as file:
        data, at, done, ended = b"", 0, 0, False
        while True:
            if len(data) - at < _LONGEST_FRAME and not ended:
                more = file.read(_CHUNK)
                ended, done = not more, done + len(more)
                data, at = data[at:] + more, 0
                moved(done / total)
            if len(data) - at < _STAMP.size + 8:
                if at < len(data):
                    yield 0.0, data[at:], None
                return
            header = parse_header(data, at + _STAMP.size) if data[at + _STAMP.size] in (0xFE, 0xFD) else None
            stamp = _STAMP.unpack_from(data, at)[0] * 1e-6
            end = at + _STAMP.size + (header.size if header else 0)
            if header is None or end > len(data) or not _EARLIEST < stamp < _LATEST:
                yield 0.0, data[at : at + 1], None
                at += 1
                continue
            frame = data[at + _STAMP.size : end]
            if header.message_id in frames.infos and not frames.is_intact(frame, header):
                yield 0.0, data[at : at + 1], None
                at += 1
                continue
            yield stamp, frame, header
            at = end


FORMAT = LogFormat((".tlog",), read)
