"""ROS 2 bag: true motion and forces of the vehicle as standard messages, in ENU and FLU (REP-103, REP-105)."""

# Times are simulated ones, from 0, as in `/clock`. Version 8 of the format is the newest that ROS 2 Humble reads.

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from cosim.errors import ExportError
from cosim.export.excerpt import Excerpt
from cosim.export.viewer_scene import POSITION, QUATERNION
from cosim.results.record import Rows
from cosim.simulation.signals import Array

MAP, ODOM, BODY = "map", "odom", "base_link"
_ENU = Rotation.from_matrix([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])  # from NED, and back
_FLU = Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))  # from FRD, and back
_VELOCITY = tuple(f"velocity.{axis}" for axis in "uvwpqr")
_WRENCHES = {"/wrench": "actuation", "/wrench_command": "command"}  # signals by topics
_TYPES = {
    "/clock": "rosgraph_msgs/msg/Clock", "/tf_static": "tf2_msgs/msg/TFMessage", "/tf": "tf2_msgs/msg/TFMessage",
    "/odom": "nav_msgs/msg/Odometry", "/pose": "geometry_msgs/msg/PoseStamped",
    "/twist": "geometry_msgs/msg/TwistStamped", **dict.fromkeys(_WRENCHES, "geometry_msgs/msg/WrenchStamped"),
}  # fmt: skip
_FOREVER = QosTime(2147483647, 4294967295)
_LATCHED = Qos(
    QosHistory.KEEP_LAST, 1, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL, _FOREVER, _FOREVER,
    QosLiveliness.AUTOMATIC, _FOREVER, False,
)  # fmt: skip
_UNQUOTED = set("?#%")  # rosbags opens the file by a URI


def write(excerpt: Excerpt, path: Path) -> list[Path]:
    """Write the folder of the bag."""
    if _UNQUOTED & set(str(path)):
        raise ExportError(f"--to rosbag2: expected a path without ?, # and %, got {path.name} in {path.parent.parent}")
    types = get_typestore(Stores.ROS2_HUMBLE)
    messages = _Messages(types.types)
    try:
        with Writer(path, version=8, storage_plugin=StoragePlugin.SQLITE3) as bag:
            connections = {
                topic: bag.add_connection(
                    topic, kind, typestore=types, offered_qos_profiles=[_LATCHED] if topic == "/tf_static" else []
                )
                for topic, kind in _TYPES.items()
            }
            for name, text in excerpt.texts.items():
                bag.set_custom_data(name, text)
            for time, topic, message in messages.of_run(excerpt):
                bag.write(connections[topic], time, types.serialize_cdr(message, _TYPES[topic]))
    except sqlite3.Error as error:  # such as a full disk
        raise ExportError(f"--to rosbag2: {path.name} cannot be written: {error}") from error
    return [path]


class _Messages:
    """Makes the messages of a run."""

    def __init__(self, types: dict[str, Any]) -> None:
        self._types = types
        self._unknown = np.zeros(36)  # covariance that is not stated

    def of_run(self, excerpt: Excerpt) -> Iterator[tuple[int, str, Any]]:
        """Yield time [ns], topic and message of all exported steps; what a step does not know is left out."""
        present = {column.name for column in excerpt.run.record.columns}
        wrenches = {
            topic: names
            for topic, group in _WRENCHES.items()
            if present.issuperset(names := [f"{group}.{axis}" for axis in "XYZKMN"])
        }
        wanted = ["time", *POSITION, *QUATERNION, *_VELOCITY, *(name for names in wrenches.values() for name in names)]
        same = self._transform(0, MAP, ODOM, np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
        yield 0, "/tf_static", self._make("tf2_msgs/msg/TFMessage", [same])
        for rows in excerpt.blocks(wanted):
            poses = _poses(rows)
            twists = _to_flu(rows.stack(_VELOCITY))
            forces = {topic: _to_flu(rows.stack(names)) for topic, names in wrenches.items()}
            for i, time in enumerate(np.rint(rows["time"] * 1e9).astype(np.int64).tolist()):
                yield time, "/clock", self._make("rosgraph_msgs/msg/Clock", self._time(time))
                for topic, message in self._of_step(time, poses[i], twists[i]):
                    yield time, topic, message
                for topic, force in forces.items():
                    if np.isfinite(force[i]).all():
                        wrench = self._make("geometry_msgs/msg/Wrench", *self._vectors(force[i]))
                        yield time, topic, self._stamped("WrenchStamped", time, BODY, wrench)

    def _of_step(self, time: int, pose: Array, twist: Array) -> Iterator[tuple[str, Any]]:
        is_posed, is_moving = np.isfinite(pose).all(), np.isfinite(twist).all()
        if is_posed:
            transform = self._transform(time, ODOM, BODY, pose[:3], pose[3:])
            yield "/tf", self._make("tf2_msgs/msg/TFMessage", [transform])
            point = self._make("geometry_msgs/msg/Point", *pose[:3])
            posed = self._make("geometry_msgs/msg/Pose", point, self._make("geometry_msgs/msg/Quaternion", *pose[3:]))
            yield "/pose", self._stamped("PoseStamped", time, MAP, posed)
        if is_moving:
            twisted = self._make("geometry_msgs/msg/Twist", *self._vectors(twist))
            yield "/twist", self._stamped("TwistStamped", time, BODY, twisted)
        if is_posed and is_moving:
            yield "/odom", self._make(
                "nav_msgs/msg/Odometry", self._header(time, ODOM), BODY,
                self._make("geometry_msgs/msg/PoseWithCovariance", posed, self._unknown),
                self._make("geometry_msgs/msg/TwistWithCovariance", twisted, self._unknown),
            )  # fmt: skip

    def _make(self, kind: str, *fields: Any) -> Any:
        return self._types[kind](*fields)

    def _time(self, time: int) -> Any:
        return self._make("builtin_interfaces/msg/Time", *divmod(time, 10**9))

    def _header(self, time: int, frame: str) -> Any:
        return self._make("std_msgs/msg/Header", self._time(time), frame)

    def _stamped(self, kind: str, time: int, frame: str, content: Any) -> Any:
        return self._make(f"geometry_msgs/msg/{kind}", self._header(time, frame), content)

    def _vectors(self, six: Array) -> list[Any]:
        return [self._make("geometry_msgs/msg/Vector3", *three) for three in (six[:3], six[3:])]

    def _transform(self, time: int, parent: str, child: str, position: Array, quaternion: Array) -> Any:
        vector = self._make("geometry_msgs/msg/Vector3", *position)
        turn = self._make("geometry_msgs/msg/Quaternion", *quaternion)
        transform = self._make("geometry_msgs/msg/Transform", vector, turn)
        return self._make("geometry_msgs/msg/TransformStamped", self._header(time, parent), child, transform)


def _poses(rows: Rows) -> Array:
    """Return position [m, ENU] and quaternion x, y, z, w of FLU in ENU, shape (rows, 7); NaN where unknown."""
    position, quaternion = rows.stack(POSITION), rows.stack(QUATERNION)
    poses = np.full((len(rows), 7), np.nan)
    known = np.isfinite(position).all(axis=1) & np.isfinite(quaternion).all(axis=1) & quaternion.any(axis=1)
    if known.any():
        turn = _ENU * Rotation.from_quat(quaternion[known], scalar_first=True) * _FLU
        poses[known] = np.hstack([position[known][:, [1, 0, 2]] * [1.0, 1.0, -1.0], turn.as_quat()])
    return poses


def _to_flu(six: Array) -> Array:
    """Convert vectors of force and moment, or of velocities, from FRD to FLU; six (rows, 6)."""
    turned: Array = six * np.tile([1.0, -1.0, -1.0], 2)
    return turned
