"""MCAP with Protobuf: every signal for PlotJuggler and Foxglove, and the scene in Foxglove's messages."""

# Times are simulated ones, in nanoseconds from 0, so that runs can be compared.

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from mcap.writer import Writer
from mcap_protobuf.schema import register_schema

from cosim.export import foxglove_scene as foxglove
from cosim.export.excerpt import Excerpt
from cosim.export.names import group_columns, valid_names
from cosim.export.protobuf_table import numbers_messages, numbers_schema
from cosim.export.viewer_scene import POSITION, QUATERNION, Scene
from cosim.replay.activity import active_at
from cosim.replay.events import events_of
from cosim.results.record import Rows
from cosim.results.run_result import Run
from cosim.results.system_run import SystemRun

PACKAGE = "subreach"  # Protobuf package of the signals' schemas
_CHUNK = 4 * 2**20  # bytes
_TOPICS = {
    "/tf_static": FrameTransforms, "/tf": FrameTransforms, "/vehicle/pose": PoseInFrame, "/vehicle/model": SceneUpdate,
    "/scene": SceneUpdate, "/log": Log,
}  # fmt: skip


def write(excerpt: Excerpt, path: Path) -> list[Path]:
    """Write the file."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=_CHUNK)
        writer.start(library="subreach")
        for name, text in excerpt.texts.items():
            kind = f"application/{name.rpartition('.')[2]}"
            writer.add_attachment(create_time=0, log_time=0, name=name, media_type=kind, data=text.encode())
        _write_messages(writer, excerpt)
        writer.finish()
    return [path]


def _write_messages(writer: Writer, excerpt: Excerpt) -> None:
    tables = _tables(writer, excerpt)
    drawing = None if isinstance(excerpt.source, SystemRun) else _Drawing(writer, excerpt.run, Scene(excerpt))
    if drawing:
        drawing.begin()
    for rows in excerpt.blocks():
        block = rows.to_array()
        times = np.rint(block[:, 0] * 1e9).astype(np.int64).tolist()
        messages = zip(*(numbers_messages(block[:, indices]) for _, indices in tables), strict=True)
        draw = drawing.row_writer(rows) if drawing else None
        for i, (time, row) in enumerate(zip(times, messages, strict=True)):
            for (channel, _), message in zip(tables, row, strict=True):
                writer.add_message(channel, time, message, time)
            if draw:
                draw(i, time)
    if drawing:
        drawing.end()


def _tables(writer: Writer, excerpt: Excerpt) -> list[tuple[int, list[int]]]:
    """Register a channel for each group of signals; return channels and indices in a row of the record."""
    tables = []
    groups = group_columns(excerpt.columns)
    for name, members in zip(valid_names(groups), groups.values(), strict=True):
        columns = [excerpt.columns[i] for i in members.values()]
        fields = valid_names(members)
        schema = writer.register_schema(f"{PACKAGE}.{name}", "protobuf", numbers_schema(PACKAGE, name, fields))
        descriptions = {f: f"{c.name} [{c.unit or '-'}]: {c.description}" for f, c in zip(fields, columns, strict=True)}
        channel = writer.register_channel(f"/signals/{name}", "protobuf", schema, metadata=descriptions)
        tables.append((channel, [excerpt.indices[i] for i in members.values()]))
    return tables


class _Drawing:
    """Writes the scene as it changes."""

    def __init__(self, writer: Writer, run: Run, scene: Scene) -> None:
        self._writer, self._run, self._scene = writer, run, scene
        self._channels = {
            topic: writer.register_channel(topic, "protobuf", register_schema(writer, message))
            for topic, message in _TOPICS.items()
        }
        self._solids = [*scene.solids]
        self._drawn: int | None = None  # index of the region that is shown as active
        self._changes, self._events = deque(scene.changes), deque(events_of(run, scene.log))

    def begin(self) -> None:
        """Write the static messages."""
        self._send("/tf_static", 0, foxglove.map_transform())
        self._send("/vehicle/model", 0, foxglove.vehicle(self._scene))

    def row_writer(self, rows: Rows) -> Callable[[int, int], None]:
        """Return a function that writes the scene of one of the rows, given its index and time [ns]."""
        known = set(np.flatnonzero(np.isfinite(rows.stack(POSITION + QUATERNION)).all(axis=1)).tolist())
        positions, quaternions = rows.stack(POSITION).tolist(), rows.stack(QUATERNION).tolist()
        shifts_by_region = {foxglove.frame_of(s): rows.stack(s.shift).tolist() for s in self._scene.solids if s.moves}
        active = active_at(self._run.scenario, rows).tolist()

        def draw(i: int, time: int) -> None:
            timestamp = foxglove.timestamp(time)
            if i in known:  # otherwise the vehicle keeps its last pose
                shifts = {frame: by_row[i] for frame, by_row in shifts_by_region.items()}
                self._send("/tf", time, foxglove.frame_transforms(timestamp, positions[i], quaternions[i], shifts))
                self._send("/vehicle/pose", time, foxglove.pose(timestamp, positions[i], quaternions[i]))
            if self._changed(time) or active[i] != self._drawn:
                self._drawn = active[i]
                self._send("/scene", time, foxglove.regions(self._solids, timestamp, active[i]))
            while self._events and self._events[0].time * 1e9 <= time:
                event = self._events.popleft()
                self._send("/log", time, foxglove.log_message(timestamp, event))

        return draw

    def _changed(self, time: int) -> bool:
        """Apply the changes that are due; return True if there was one."""
        changed = False
        while self._changes and self._changes[0][0] * 1e9 <= time:
            _, i, self._solids[i] = self._changes.popleft()
            changed = True
        return changed

    def end(self) -> None:
        """Write the events after the last exported step."""
        for event in self._events:
            time = round(event.time * 1e9)
            self._send("/log", time, foxglove.log_message(foxglove.timestamp(time), event))

    def _send(self, topic: str, time: int, message: Any) -> None:
        self._writer.add_message(self._channels[topic], time, message.SerializeToString(), time)
