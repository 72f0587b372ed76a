"""RRD, Rerun's recordings: every signal as a series over simulated time, and the scene in three dimensions."""

# Series are of doubles; the scene is of single precision, the only one that Rerun has for it.

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from controller.regions import Box, Ellipsoid, Sphere
from cosim.errors import ExportError
from cosim.export.excerpt import Excerpt
from cosim.export.names import group_columns
from cosim.export.viewer_scene import (
    BODY,
    HULL_COLOR,
    NED,
    OPAQUE,
    PLACE,
    POSITION,
    QUATERNION,
    THRUST_COLOR,
    TRAIL_COLOR,
    Scene,
    Solid,
)
from cosim.replay.activity import active_at
from cosim.replay.events import events_of
from cosim.results.record import Rows
from cosim.simulation.signals import Array

TIMELINE = "sim_time"  # name of the time line, in s
SIGNALS, WORLD, EVENTS = "signals", "world", "events"
_FRAMES = {NED: f"{WORLD}/regions", PLACE: f"{WORLD}/place", BODY: f"{WORLD}/place/body"}
_CHARTS = ("clearance", "weight", "command", "thruster_force", "estimate")  # groups in the default layout
_FAINT, _BRIGHT = 110, 255  # opacity of the lines of inactive and active regions
_THIN, _THICK = 1.0, 2.5  # pixels, width of these lines; Rerun reads negative radii as pixels
_ARROWS = 20.0  # Hz, rate of the thrusters' arrows
_ARROW = 4.0  # hull radii, length of the arrow of the greatest thrust


def write(excerpt: Excerpt, path: Path) -> list[Path]:
    """Write the file."""
    recording = rr.RecordingStream("subreach")
    try:
        recording.save(path, default_blueprint=_layout(excerpt))
        recording.send_recording_name(excerpt.run.folder.resolve().name)
        sender = _Sender(recording, excerpt)
        sender.send_texts()
        sender.send_names()
        sender.send_vehicle()
        sender.send_regions()
        sender.send_rows()
        sender.send_events()
        recording.flush()
    except RuntimeError as error:  # raised by Rerun when the disk is full
        raise ExportError(f"--to rrd: {path.name} cannot be written: {error}") from error
    finally:
        recording.disconnect()
    return [path]


def _layout(excerpt: Excerpt) -> rrb.Blueprint:
    """Return the default layout: the scene, and charts beside it."""
    there = [name for name in _CHARTS if name in group_columns(excerpt.columns)]
    charts = [rrb.TimeSeriesView(origin=rr.new_entity_path([SIGNALS, name]), name=name) for name in there]
    texts = rrb.Tabs(
        rrb.TextLogView(origin=EVENTS, name=EVENTS),
        *(rrb.TextDocumentView(origin=name, name=name) for name in ("summary", "scenario")),
    )
    # the first two charts separately, the others in tabs
    column = rrb.Vertical(*charts[:2], *([rrb.Tabs(*charts[2:])] if charts[2:] else []), texts)
    scene = rrb.Spatial3DView(origin=WORLD, name="scene")
    return rrb.Blueprint(rrb.Horizontal(scene, column, column_shares=[3, 2]), collapse_panels=True)


class _Sender:
    """Sends a run: static data, then its rows block by block, then its events."""

    def __init__(self, recording: rr.RecordingStream, excerpt: Excerpt) -> None:
        self._recording, self._excerpt, self._scene = recording, excerpt, Scene(excerpt)
        scene, names = self._scene, [column.name for column in excerpt.run.record.columns]
        self._forces = [f"thruster_force[{i + 1}]" for i in range(len(scene.thrusters))]
        self._max_force = max((thruster.max_force for thruster in scene.thrusters), default=0.0)
        if not self._max_force > 0.0 or not set(self._forces) <= set(names):
            self._forces = []
        self._series: dict[str, str] = {}  # signals by their paths
        self._lines: list[tuple[int, Solid, dict[str, Any]]] = []  # regions, by index, with their kinds of drawing

    def send_texts(self) -> None:
        """Send scenario and summary."""
        for file, text in self._excerpt.texts.items():
            name, _, kind = file.partition(".")
            self._stay(name, rr.TextDocument(f"```{kind}\n{text}\n```", media_type=rr.MediaType.MARKDOWN))

    def send_names(self) -> None:
        """Send name and unit of every signal."""
        for group, members in group_columns(self._excerpt.columns).items():
            for name, i in members.items():
                column = self._excerpt.columns[i]
                path = rr.new_entity_path([SIGNALS, group, name])
                self._stay(path, rr.SeriesLines(names=f"{column.name} [{column.unit or '-'}]"))
                self._series[path] = column.name

    def send_vehicle(self) -> None:
        """Send the hull and the path of the run."""
        scene = self._scene
        self._stay(WORLD, rr.ViewCoordinates.FRD)  # north, east, down
        hull = rr.Ellipsoids3D(half_sizes=[[scene.hull_radius] * 3], colors=[HULL_COLOR])
        self._stay(f"{_FRAMES[BODY]}/hull", hull)
        self._stay(f"{WORLD}/way", rr.LineStrips3D([scene.trail()], colors=[TRAIL_COLOR], radii=[-_THIN]))
        if self._forces:
            positions = [thruster.position for thruster in scene.thrusters]
            self._stay(f"{_FRAMES[BODY]}/thrusts", rr.Arrows3D.from_fields(origins=positions, colors=[THRUST_COLOR]))

    def send_regions(self) -> None:
        """Send regions as lines."""
        scene, began = self._scene, self._excerpt.run.record.value("time", 0)
        for i, solid in enumerate(scene.solids):
            entity_path = f"{_FRAMES[solid.frame]}/{rr.escape_entity_path_part(solid.name)}"
            shapes = [(began, solid), *((time, new) for time, j, new in scene.changes if j == i)]
            self._lines.append((i, solid, self._send_shapes(entity_path, shapes)))

    def send_rows(self) -> None:
        """Send every signal as a series, and the motion of the scene."""
        began, tick, before = None, -1.0, None
        for block in self._excerpt.blocks():
            time = block["time"]
            for path, name in self._series.items():
                self._send(time, path, rr.Scalars.columns(scalars=block[name]))
            self._send_pose(block)
            began = time[0] if began is None else began
            ticks = np.floor((time - began) * _ARROWS)
            self._send_thrusts(block, np.flatnonzero(np.diff(ticks, prepend=tick) > 0.0))
            active = active_at(self._excerpt.run.scenario, block)
            self._send_activity(time, active, before)
            tick, before = ticks[-1], active[-1]
            self._recording.flush()  # bounds the memory of data that is not written yet

    def _send_pose(self, block: Rows) -> None:
        position, e = block.stack(POSITION), block.stack(QUATERNION)
        known = np.isfinite(position).all(axis=1) & np.isfinite(e).all(axis=1)
        time = block["time"]
        self._send(time[known], _FRAMES[PLACE], rr.Transform3D.columns(translation=position[known]))
        self._send(time[known], _FRAMES[BODY], rr.Transform3D.columns(quaternion=e[known][:, [1, 2, 3, 0]]))
        for solid in self._scene.solids:
            if solid.moves:
                entity_path = f"{_FRAMES[solid.frame]}/{rr.escape_entity_path_part(solid.name)}"
                self._send(time, entity_path, rr.Transform3D.columns(translation=block.stack(solid.shift)))

    def _send_thrusts(self, block: Rows, rows: NDArray[np.intp]) -> None:
        if not self._forces:
            return
        scene, n = self._scene, len(self._forces)
        force = np.nan_to_num(block.take(rows).stack(self._forces))
        directions = np.array([thruster.direction for thruster in scene.thrusters])
        vectors = force[:, :, None] * directions * (_ARROW * scene.hull_radius / self._max_force)
        arrows = rr.Arrows3D.columns(vectors=vectors.reshape(-1, 3)).partition([n] * len(rows))
        self._send(block["time"][rows], f"{_FRAMES[BODY]}/thrusts", arrows)

    def _send_activity(self, time: Array, active: NDArray[np.intp], before: int | None) -> None:
        """Send regions brighter and thicker while they are active."""
        for i, solid, kinds in self._lines:
            now = active == i
            changes = np.flatnonzero(np.diff(now, prepend=not now[0] if before is None else before == i))
            for path, kind in kinds.items():
                self._send(time[changes], path, kind.columns(**_activity_attributes(kind, solid.color, now[changes])))

    def _send_shapes(self, entity_path: str, shapes: list[tuple[float, Solid]]) -> dict[str, Any]:
        """Send the shapes of a region over time; return the types of its drawings by path."""
        kinds: dict[str, Any] = {}
        before = None
        for time, solid in shapes:
            drawn = _archetype(solid)
            path = f"{entity_path}/{type(drawn).__name__}"
            kinds[path] = type(drawn)
            self._recording.set_time(TIMELINE, duration=time)
            if before not in (None, path):  # the type of the shape has changed
                self._recording.log(before, rr.Clear(recursive=False))
            self._recording.log(path, drawn, strict=True)
            before = path
        return kinds

    def send_events(self) -> None:
        """Send the events as log texts."""
        for event in events_of(self._excerpt.run, self._scene.log):
            level = "WARN" if event.kind in ("violation", "failure", "saturation") else "INFO"
            self._recording.set_time(TIMELINE, duration=event.time)
            self._recording.log(EVENTS, rr.TextLog(event.text, level=level))

    def _send(self, time: Array, path: str, columns: Any) -> None:
        if time.size:
            index = rr.TimeColumn(TIMELINE, duration=time)
            self._recording.send_columns(path, indexes=[index], columns=columns, strict=True)

    def _stay(self, path: str, what: Any) -> None:
        self._recording.log(path, what, static=True, strict=True)


def _archetype(solid: Solid) -> Any:
    """Return the Rerun archetype of a region; attributes that depend on activity are sent over time."""
    shape, label = solid.shape, {"labels": [solid.label]}
    if isinstance(shape, Sphere):
        return rr.Ellipsoids3D.from_fields(half_sizes=[[shape.radius] * 3], centers=[shape.center], **label)
    if isinstance(shape, Ellipsoid):
        return rr.Ellipsoids3D.from_fields(
            half_sizes=[shape.semi_axes], centers=[shape.center], quaternions=[_turn(shape.quaternion)], **label
        )
    if isinstance(shape, Box):
        half = [[size / 2.0 for size in shape.size]]
        return rr.Boxes3D.from_fields(
            half_sizes=half, centers=[shape.center], quaternions=[_turn(shape.quaternion)], **label
        )
    return rr.Mesh3D(vertex_positions=solid.mesh.vertices, triangle_indices=solid.mesh.triangles)


def _activity_attributes(kind: Any, color: tuple[int, int, int], active: NDArray[np.bool_]) -> dict[str, Any]:
    """Return the attributes that show whether a region is active, for each change of activity."""
    if kind is rr.Mesh3D:
        return {"albedo_factor": [(*color, round(255 * OPAQUE[bool(now)])) for now in active]}
    width = "line_radii" if kind is rr.Ellipsoids3D else "radii"
    return {
        "colors": [(*color, _BRIGHT if now else _FAINT) for now in active],
        width: [-(_THICK if now else _THIN) for now in active],
    }


def _turn(quaternion: tuple[float, ...]) -> Any:
    e = np.array(quaternion) / np.linalg.norm(quaternion)
    return rr.Quaternion(xyzw=e[[1, 2, 3, 0]])
