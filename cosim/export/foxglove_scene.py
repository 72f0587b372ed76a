"""The scene of a run in Foxglove's messages: frames, pose, and regions as entities."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.timestamp_pb2 import Timestamp
from scipy.spatial.transform import Rotation

from controller.regions import Box, Cylinder, Ellipsoid, Sphere
from controller.regions.region_set import of_attitude
from cosim.export.viewer_scene import BODY, HULL_COLOR, NED, OPAQUE, PLACE, THRUST_COLOR, TRAIL_COLOR, Scene, Solid
from cosim.replay.events import Event
from cosim.simulation.signals import Array

MAP = "map"  # frame with z upwards, as in Foxglove
_HALF_TURN = (0.0, math.sqrt(0.5), math.sqrt(0.5), 0.0)  # about north-east: (north, east, down) to (east, north, up)
_X, _Z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
_LETTERS = 14.0  # pixels, font size
_LINE = 2.0  # pixels, width
_ARROW = 2.0  # hull radii, length of the arrow of the largest thrust


def timestamp(nanoseconds: int) -> Timestamp:
    """Convert a time [ns] to a Foxglove timestamp."""
    return Timestamp(seconds=nanoseconds // 10**9, nanos=nanoseconds % 10**9)


def map_transform() -> FrameTransforms:
    """Return the transform from NED to the map frame, at time 0."""
    message = FrameTransforms()
    _add_transform(message, timestamp(0), MAP, NED, (0.0, 0.0, 0.0), _HALF_TURN)
    return message


def frame_of(solid: Solid) -> str:
    """Return the frame of a region's coordinates; a moving region has its own frame."""
    return f"region {solid.name}" if solid.moves else solid.frame


def frame_transforms(
    time: Timestamp, position: Sequence[float], quaternion: Sequence[float], shifts: dict[str, Sequence[float]]
) -> FrameTransforms:
    """Return the transforms of the vehicle and of moving regions; position, quaternion [m, NED], shifts [m, NED]."""
    message = FrameTransforms()
    _add_transform(message, time, NED, PLACE, position, (1.0, 0.0, 0.0, 0.0))
    _add_transform(message, time, PLACE, BODY, (0.0, 0.0, 0.0), quaternion)
    for frame, shift in shifts.items():
        _add_transform(message, time, NED, frame, shift, (1.0, 0.0, 0.0, 0.0))
    return message


def pose(time: Timestamp, position: Sequence[float], quaternion: Sequence[float]) -> PoseInFrame:
    """Return the pose of the vehicle: position [m, NED] and attitude, body to NED."""
    message = PoseInFrame(timestamp=time, frame_id=NED)
    _set_pose(message.pose, position, quaternion)
    return message


def regions(solids: Sequence[Solid], time: Timestamp, active: int) -> SceneUpdate:
    """Return all regions, the active one less transparent."""
    message = SceneUpdate()
    for i, solid in enumerate(solids):
        entity = message.entities.add(timestamp=time, frame_id=frame_of(solid), id=solid.name, frame_locked=True)
        entity.metadata.add(key="active", value=str(i == active).lower())
        _draw(entity, solid, i == active)
        text = entity.texts.add(billboard=True, font_size=_LETTERS, scale_invariant=True)
        text.text = f"{solid.label} (active)" if i == active else solid.label
        _set_pose(text.pose, _label_place(solid).tolist(), (1.0, 0.0, 0.0, 0.0))
        _set_color(text.color, solid.color, 1.0)
    return message


def vehicle(scene: Scene) -> SceneUpdate:
    """Return the hull and the thrusters' lines of action in the body frame, and the path of the run as a line."""
    message = SceneUpdate()
    entity = message.entities.add(frame_id=BODY, id="vehicle", frame_locked=True)
    ball = entity.spheres.add()
    _set_pose(ball.pose, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    _set_vector(ball.size, [2.0 * scene.hull_radius] * 3)
    _set_color(ball.color, HULL_COLOR, 0.6)
    largest_force = max((thruster.max_force for thruster in scene.thrusters), default=1.0) or 1.0
    for thruster in scene.thrusters:
        length = _ARROW * scene.hull_radius * thruster.max_force / largest_force
        if length > 0.0 and np.linalg.norm(thruster.direction) > 0.0:
            arrow = entity.arrows.add(shaft_length=0.7 * length, head_length=0.3 * length)
            arrow.shaft_diameter, arrow.head_diameter = 0.05 * length, 0.15 * length
            _set_pose(arrow.pose, thruster.position.tolist(), _shortest_turn(_X, thruster.direction))
            _set_color(arrow.color, THRUST_COLOR, 1.0)
    trail = message.entities.add(frame_id=NED, id="way", frame_locked=True)
    line = trail.lines.add(type=LinePrimitive.LINE_STRIP, thickness=_LINE, scale_invariant=True)
    _set_pose(line.pose, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    _set_color(line.color, TRAIL_COLOR, 0.8)
    for point in scene.trail().tolist():
        _set_vector(line.points.add(), point)
    return message


def log_message(time: Timestamp, event: Event) -> Log:
    """Return a log message for an event."""
    level = Log.WARNING if event.kind in ("violation", "failure", "saturation") else Log.INFO
    return Log(timestamp=time, level=level, message=event.text, name=event.kind)


def _draw(entity: SceneEntity, solid: Solid, active: bool) -> None:
    shape, opaque = solid.shape, OPAQUE[active]
    at_rest = (1.0, 0.0, 0.0, 0.0)
    if isinstance(shape, Sphere):
        primitive = entity.spheres.add()
        _set_pose(primitive.pose, shape.center, at_rest)
        _set_vector(primitive.size, [2.0 * shape.radius] * 3)
    elif isinstance(shape, Ellipsoid):
        primitive = entity.spheres.add()
        _set_pose(primitive.pose, shape.center, _unit(shape.quaternion))
        _set_vector(primitive.size, [2.0 * a for a in shape.semi_axes])
    elif isinstance(shape, Box):
        primitive = entity.cubes.add()
        _set_pose(primitive.pose, shape.center, _unit(shape.quaternion))
        _set_vector(primitive.size, shape.size)
    elif isinstance(shape, Cylinder):
        primitive = entity.cylinders.add(bottom_scale=1.0, top_scale=1.0)
        start, end = np.array(shape.start), np.array(shape.end)
        _set_pose(primitive.pose, ((start + end) / 2.0).tolist(), _shortest_turn(_Z, end - start))
        _set_vector(primitive.size, [2.0 * shape.radius, 2.0 * shape.radius, float(np.linalg.norm(end - start))])
    else:
        primitive = entity.triangles.add()
        _set_pose(primitive.pose, (0.0, 0.0, 0.0), at_rest)
        for point in solid.mesh.vertices.tolist():
            _set_vector(primitive.points.add(), point)
        primitive.indices.extend(solid.mesh.triangles.ravel().tolist())
    _set_color(primitive.color, solid.color, opaque)


def _label_place(solid: Solid) -> Array:
    """Return the position of a region's label: above it, or at the end of the axis of an attitude region."""
    vertices = solid.mesh.vertices
    if of_attitude(solid.shape):
        return np.asarray(vertices[-1])
    top = vertices.mean(axis=0)
    top[2] = vertices[:, 2].min()
    return np.asarray(top)


def _add_transform(
    message: FrameTransforms, time: Timestamp, parent: str, child: str, by: Sequence[float], turn: Sequence[float]
) -> None:
    transform = message.transforms.add(timestamp=time, parent_frame_id=parent, child_frame_id=child)
    _set_vector(transform.translation, by)
    _set_quaternion(transform.rotation, turn)


def _set_pose(message: Any, position: Sequence[float], quaternion: Sequence[float]) -> None:
    _set_vector(message.position, position)
    _set_quaternion(message.orientation, quaternion)


def _set_vector(message: Any, vector: Sequence[float]) -> None:
    message.x, message.y, message.z = vector


def _set_quaternion(message: Any, e: Sequence[float]) -> None:
    message.w, message.x, message.y, message.z = e


def _set_color(message: Any, color: tuple[int, int, int], opaque: float) -> None:
    message.r, message.g, message.b = (part / 255.0 for part in color)
    message.a = opaque


def _unit(quaternion: Sequence[float]) -> list[float]:
    e: list[float] = Rotation.from_quat(quaternion, scalar_first=True).as_quat(scalar_first=True).tolist()
    return e


def _shortest_turn(start: Array, direction: Array) -> list[float]:
    """Return the quaternion of the shortest rotation of a vector into a direction."""
    e: list[float] = Rotation.align_vectors(direction, start)[0].as_quat(scalar_first=True).tolist()
    return e
