"""Bags of ROS 2, written by mcap-ros2-support, and logs of PX4, read beside pyulog."""

import struct

import numpy as np
import pytest

import cosim
from cosim.errors import ImportLogError
from cosim.results.log_facts import load_log_facts
from tests.cosim.logs.dive import Dive, errors

writer = pytest.importorskip("mcap_ros2.writer")
pyulog = pytest.importorskip("pyulog")

ODOMETRY = """std_msgs/Header header
string child_frame_id
geometry_msgs/Pose pose
geometry_msgs/Twist twist
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
================================================================================
MSG: geometry_msgs/Twist
geometry_msgs/Vector3 linear
geometry_msgs/Vector3 angular
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"""
FORCES = "float64[] data\n"
MAP = """
world = "ENU"
body = "FLU"

[position]
topic = "/odom"
columns = ["pose.position.x", "pose.position.y", "pose.position.z"]
time = { column = "header.stamp" }

[attitude]
topic = "/odom"
columns = ["pose.orientation.x", "pose.orientation.y", "pose.orientation.z", "pose.orientation.w"]
quaternion = "xyzw"
time = { column = "header.stamp" }

[velocity]
topic = "/odom"
columns = ["twist.linear.x", "twist.linear.y", "twist.linear.z"]
time = { column = "header.stamp" }

[thrust]
topic = "/thrusters"
columns = ["data[0]", "data[1]", "data[2]", "data[3]", "data[4]", "data[5]", "data[6]", "data[7]"]
"""
START = 1_700_000_000


def write_bag(path, dive):
    """Odometry at 20 Hz in ENU and FLU, and forces of thrusters; each message comes 80 ms after its stamp."""
    from scipy.spatial.transform import Rotation

    swap = Rotation.from_matrix([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
    flip = Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))
    R = Rotation.from_quat(np.roll(dive.quaternion, -1, axis=1))
    quaternions = (swap * R * flip).as_quat()
    velocities = R.inv().apply(dive.velocity_world) * [1, -1, -1]
    with path.open("wb") as file:
        bag = writer.Writer(file, chunk_size=20_000)
        odometry = bag.register_msgdef("nav_msgs/msg/Odometry", ODOMETRY)
        forces = bag.register_msgdef("std_msgs/msg/Float64MultiArray", FORCES)
        for k, t in enumerate(dive.times):
            stamp = round(1e9 * t)
            (n, e, d), (x, y, z, w), (u, v, up) = dive.position[k], quaternions[k], velocities[k]
            bag.write_message("/odom", odometry, {
                "header": {"stamp": {"sec": START + stamp // 10**9, "nanosec": stamp % 10**9}, "frame_id": "odom"},
                "child_frame_id": "base_link",
                "pose": {"position": {"x": e, "y": n, "z": -d}, "orientation": {"x": x, "y": y, "z": z, "w": w}},
                "twist": {"linear": {"x": u, "y": v, "z": up}, "angular": {"x": 0.0, "y": 0.0, "z": 0.0}},
            }, log_time=START * 10**9 + stamp + 80_000_000)  # fmt: skip
            bag.write_message("/thrusters", forces, {"data": dive.thrust[k].tolist()}, log_time=START * 10**9 + stamp)
            bag.write_message("/else", forces, {"data": []}, log_time=START * 10**9 + stamp)
        bag.finish()


@pytest.fixture(scope="module")
def dive():
    return Dive(np.arange(0.0, 30.0, 0.05))


@pytest.fixture(scope="module")
def bag(tmp_path_factory, dive):
    path = tmp_path_factory.mktemp("bag") / "dive.mcap"
    write_bag(path, dive)
    return path


@pytest.fixture
def columns(tmp_path):
    (tmp_path / "map.toml").write_text(MAP)
    return tmp_path / "map.toml"


def test_imported_bag_matches_the_dive(bag, columns, dive, tmp_path):
    run = cosim.import_log(bag, "bluerov2_heavy", tmp_path / "run", columns=columns, report=False)
    for names, expected in (
        ([f"position.{a}" for a in "xyz"], dive.position),
        (["attitude.roll", "attitude.pitch", "attitude.yaw"], np.column_stack([dive.roll, dive.pitch, dive.yaw])),
        ([f"thrust[{i}]" for i in range(1, 9)], dive.thrust),
    ):
        error, known = errors(run.record, dive, names, expected)
        assert error < 1e-6 and known > 0.99, names
    facts = load_log_facts(run.folder)
    assert facts.unread == {"/else": len(dive.times)}
    assert facts.start == pytest.approx(START, abs=1e-3)


def test_truncated_bag_is_read_to_its_end(bag, columns, tmp_path):
    data = bag.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) // 2])
    run = cosim.import_log(tmp_path / "cut.mcap", "bluerov2_heavy", tmp_path / "run", columns=columns, report=False)
    assert any("breaks off" in remark for remark in load_log_facts(run.folder).remarks)
    assert 0.0 < run.summary["simulated_time"] < 20.0


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ('topic = "/thrusters"', 'topic = "/thruster"', "has no topic '/thruster', .*did you mean '/thrusters'"),
        ("pose.position.z", "pose.position.zz", r"/odom has no field 'pose\.position\.zz'"),
        ("pose.position.z", "header.frame_id", "/odom: header.frame_id is str, expected a number"),
        ("pose.position.z", "pose position", "is no path, expected one such as"),
        ('topic = "/thrusters"\n', "", r"the map says no topic for \[thrust\]"),
        ("data[7]", "data[8]", r"/thrusters has no field 'data\[8\]'"),
    ],
)
def test_missing_bag_topics_are_named(bag, columns, tmp_path, old, new, what):
    columns.write_text(MAP.replace(old, new, 1))
    with pytest.raises(ImportLogError, match=what):
        cosim.import_log(bag, "bluerov2_heavy", tmp_path / "run", columns=columns)
    assert not (tmp_path / "run").exists()


def write_ulog(path, dive):
    """A log of PX4, byte by byte as its format is described; pyulog must read it as well."""
    formats = {
        "vehicle_attitude": "uint64_t timestamp;float[4] q;",
        "vehicle_local_position": "uint64_t timestamp;float x;float y;float z;float vx;float vy;float vz;",
        "actuator_motors": "uint64_t timestamp;float[8] control;",
        "something_else": "uint64_t timestamp;float a;",
    }

    def message(kind, body):
        return struct.pack("<HB", len(body), ord(kind)) + body

    with path.open("wb") as file:
        file.write(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 5_000_000))
        file.write(message("B", bytes(40)))
        for name, fields in formats.items():
            file.write(message("F", f"{name}:{fields}".encode()))
        key = b"int32_t MAV_TYPE"
        file.write(message("P", bytes([len(key)]) + key + struct.pack("<i", 12)))
        for number, name in enumerate(formats):
            file.write(message("A", struct.pack("<BH", 0, number) + name.encode()))
        for k, t in enumerate(dive.times):
            stamp = struct.pack("<Q", 5_000_000 + round(1e6 * t))
            rows = (dive.quaternion[k], [*dive.position[k], *dive.velocity_world[k]], dive.thrust[k] / 40.0, [1.0])
            for number, values in enumerate(rows):
                data = struct.pack("<H", number) + stamp + struct.pack(f"<{len(values)}f", *values)
                file.write(message("D", data))


def test_imported_px4_log_matches_the_dive(dive, tmp_path):
    path = tmp_path / "dive.ulg"
    write_ulog(path, dive)
    theirs = {data.name: data.data for data in pyulog.ULog(str(path)).data_list}
    assert len(theirs["vehicle_attitude"]["timestamp"]) == len(dive.times)
    run = cosim.import_log(path, "bluerov2_heavy", tmp_path / "run", report=False)
    for names, expected in (
        ([f"position.{a}" for a in "xyz"], dive.position),
        (["attitude.roll", "attitude.pitch", "attitude.yaw"], np.column_stack([dive.roll, dive.pitch, dive.yaw])),
        ([f"thrust[{i}]" for i in range(1, 9)], dive.thrust),
    ):
        error, known = errors(run.record, dive, names, expected)
        assert error < 2e-6 and known == 1.0, names
    assert run.summary["law"] == "px4"
    assert "something_else" in load_log_facts(run.folder).unread


def test_truncated_px4_log_is_read_to_its_end(dive, tmp_path):
    path = tmp_path / "dive.ulg"
    write_ulog(path, dive)
    data = path.read_bytes()
    path.write_bytes(data[: int(0.6 * len(data))])
    run = cosim.import_log(path, "bluerov2_heavy", tmp_path / "run", report=False)
    assert 15.0 < run.summary["simulated_time"] < 19.0


@pytest.mark.parametrize("suffix", [".mcap", ".ulg"])
def test_missing_library_is_reported(tmp_path, columns, monkeypatch, suffix):
    import sys

    for name in ("mcap_ros2", "mcap_ros2.decoder", "pyulog", "pyulog.core"):
        monkeypatch.setitem(sys.modules, name, None)
    (tmp_path / f"it{suffix}").write_bytes(b"x" * 100)
    given = {"columns": columns} if suffix == ".mcap" else {}
    with pytest.raises(ImportLogError, match=r"needs (mcap_ros2|pyulog).*pip install"):
        cosim.import_log(tmp_path / f"it{suffix}", "bluerov2_heavy", tmp_path / "run", **given)
