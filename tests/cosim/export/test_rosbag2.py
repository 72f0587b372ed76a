"""ROS 2 bags: standard messages in ENU and FLU, decoded by another library than the one that writes them."""

import sqlite3
from operator import attrgetter

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cosim.command_line.cli import main
from cosim.errors import ExportError
from cosim.export import export_run
from cosim.results.record import load_record
from tests.cosim.export.conftest import GAP

rosbag2 = pytest.importorskip("rosbags.rosbag2")
dynamic = pytest.importorskip("mcap_ros2._dynamic")
TYPES = {
    "/clock": "rosgraph_msgs/msg/Clock", "/tf_static": "tf2_msgs/msg/TFMessage", "/tf": "tf2_msgs/msg/TFMessage",
    "/odom": "nav_msgs/msg/Odometry", "/pose": "geometry_msgs/msg/PoseStamped",
    "/twist": "geometry_msgs/msg/TwistStamped", "/wrench": "geometry_msgs/msg/WrenchStamped",
    "/wrench_command": "geometry_msgs/msg/WrenchStamped",
}  # fmt: skip


def messages(bag):
    """Return, by topic, times [ns] and messages, decoded by the definitions that the bag holds."""
    with sqlite3.connect(bag / f"{bag.name}.db3") as database:
        decoders = {
            kind: dynamic.generate_dynamic(kind, text)[kind]
            for kind, text in database.execute("SELECT topic_type, encoded_message_definition FROM message_definitions")
        }
        found = {}
        rows = database.execute(
            "SELECT name, type, timestamp, data FROM messages JOIN topics ON topic_id = topics.id ORDER BY messages.id"
        )
        for topic, kind, time, data in rows.fetchall():
            found.setdefault(topic, []).append((time, decoders[kind](data)))
    database.close()
    return found


def components(vector, axes="xyz"):
    """Return the components of a vector or quaternion."""
    return [getattr(vector, axis) for axis in axes]


def stamp(header):
    """Return the time of a header [ns]."""
    return header.stamp.sec * 10**9 + header.stamp.nanosec


@pytest.fixture(scope="module")
def bag(run, tmp_path_factory):
    """The folder of the bag of a run."""
    (folder,) = export_run(run, "rosbag2", tmp_path_factory.mktemp("bag") / "dock")
    return folder


def test_bag_opens_with_counts_of_messages(run, bag):
    assert sorted(path.name for path in bag.iterdir()) == ["dock.db3", "metadata.yaml"]
    with rosbag2.Reader(bag) as reader:
        assert {c.topic: c.msgtype for c in reader.connections} == TYPES
        counts = {c.topic: c.msgcount for c in reader.connections}
        assert (reader.start_time, reader.duration) == (0, 10**9 + 1)
    assert counts == {topic: 1 if topic == "/tf_static" else 101 for topic in TYPES}


def test_metadata_is_of_the_version_that_humble_reads(run, bag):
    from ruamel.yaml import YAML

    information = YAML(typ="safe").load(bag / "metadata.yaml")["rosbag2_bagfile_information"]
    assert (information["version"], information["storage_identifier"]) == (8, "sqlite3")
    assert information["custom_data"].keys() == {"scenario.toml", "summary.json"}
    assert information["custom_data"]["scenario.toml"] == (run / "scenario.toml").read_text()
    profiles = {
        t["topic_metadata"]["name"]: t["topic_metadata"]["offered_qos_profiles"]
        for t in information["topics_with_message_count"]
    }
    assert all(isinstance(text, str) for text in profiles.values())  # a list from version 9 on, which Humble refuses
    (latched,) = YAML(typ="safe").load(profiles["/tf_static"])
    assert (latched["durability"], latched["reliability"], latched["depth"]) == (1, 1, 1)  # transient local, reliable


def test_values_are_those_of_the_record_in_enu_and_flu(run, bag):
    record, found = load_record(run), messages(bag)
    times = np.rint(record["time"] * 1e9).astype(int).tolist()
    for topic in TYPES.keys() - {"/tf_static"}:
        assert [time for time, _ in found[topic]] == times, topic
    assert [m.clock.sec * 10**9 + m.clock.nanosec for _, m in found["/clock"]] == times
    (same,) = found["/tf_static"][0][1].transforms
    assert (same.header.frame_id, same.child_frame_id) == ("map", "odom")
    assert components(same.transform.translation) + components(same.transform.rotation, "xyzw") == [0] * 6 + [1]

    def numbers(topic, *members):
        """Return components of a message, by the members' path and axes, such as "pose.position xyz"."""
        rows = []
        for _, message in found[topic]:
            content = message.transforms[0] if topic == "/tf" else message
            parts = [member.split() for member in members]
            rows.append([x for path, axes in parts for x in components(attrgetter(path)(content), axes)])
        return np.array(rows)

    position = np.column_stack([record["position.y"], record["position.x"], -record["position.z"]])
    # yaw is from east to the left, and a nose-up pitch is negative about the axis to the left
    angles = np.column_stack([np.pi / 2 - record["attitude.yaw"], -record["attitude.pitch"], record["attitude.roll"]])
    for topic, place, turn in (
        ("/tf", "transform.translation", "transform.rotation"),
        ("/pose", "pose.position", "pose.orientation"),
        ("/odom", "pose.pose.position", "pose.pose.orientation"),
    ):
        assert np.array_equal(numbers(topic, f"{place} xyz"), position)
        attitude = Rotation.from_quat(numbers(topic, f"{turn} xyzw"))
        assert (attitude.inv() * Rotation.from_euler("ZYX", angles)).magnitude().max() < 1e-9
    sixes = {
        "/twist": ("twist.linear xyz", "twist.angular xyz"),
        "/odom": ("twist.twist.linear xyz", "twist.twist.angular xyz"),
        "/wrench": ("wrench.force xyz", "wrench.torque xyz"),
        "/wrench_command": ("wrench.force xyz", "wrench.torque xyz"),
    }
    names = {"/wrench": ("actuation", "XYZKMN"), "/wrench_command": ("command", "XYZKMN")}
    for topic, members in sixes.items():
        group, axes = names.get(topic, ("velocity", "uvwpqr"))
        forward = np.column_stack([record[f"{group}.{axis}"] for axis in axes])
        expected = forward * [1, -1, -1, 1, -1, -1]
        assert np.abs(expected).max() > 0.05 and np.array_equal(numbers(topic, *members), expected), topic
    frames = {
        "/pose": "map",
        "/odom": "odom",
        "/twist": "base_link",
        "/wrench": "base_link",
        "/wrench_command": "base_link",
    }
    for topic, frame in frames.items():
        assert {m.header.frame_id for _, m in found[topic]} == {frame}
        assert [stamp(m.header) for _, m in found[topic]] == times
    assert {m.child_frame_id for _, m in found["/odom"]} == {"base_link"}
    assert {(m.transforms[0].header.frame_id, m.transforms[0].child_frame_id) for _, m in found["/tf"]} == {
        ("odom", "base_link")
    }
    assert [stamp(m.transforms[0].header) for _, m in found["/tf"]] == times


def test_steps_without_a_pose_have_none(killed, tmp_path):
    (bag,) = export_run(killed, "rosbag2", tmp_path / "bag")
    found = messages(bag)
    missing = GAP.stop - GAP.start
    assert {topic: len(found[topic]) for topic in ("/clock", "/twist")} == {"/clock": 101, "/twist": 101}
    assert {len(found[topic]) for topic in ("/tf", "/pose", "/odom")} == {101 - missing}


def test_steps_are_thinned_and_signals_are_not_selected(run, tmp_path, capsys):
    (bag,) = export_run(run, "rosbag2", tmp_path / "bag", every=10)
    assert len(messages(bag)["/pose"]) == 11
    assert main(["export", str(run), "--to", "rosbag2", "--signals", "time", "--out", str(tmp_path / "other")]) == 2
    assert "expected without --signals, since" in capsys.readouterr().err


def test_only_a_bag_is_replaced_and_only_by_force(run, tmp_path):
    out = tmp_path / "bag"
    export_run(run, "rosbag2", out)
    with pytest.raises(ExportError, match="exists"):
        export_run(run, "rosbag2", out)
    export_run(run, "rosbag2", out, every=50, force=True)
    assert len(messages(out)["/pose"]) == 3
    (out / "notes.txt").write_text("mine")
    with pytest.raises(ExportError, match="exists"):
        export_run(run, "rosbag2", out, force=True)
    assert [path.name for path in tmp_path.iterdir()] == ["bag"]


@pytest.mark.parametrize("there", [False, True])
def test_full_disk_leaves_what_was_there(run, tmp_path, there):
    resource = pytest.importorskip("resource")
    out = tmp_path / "bag"
    if there:
        export_run(run, "rosbag2", out, every=50)
    before = {path: path.read_bytes() for path in tmp_path.rglob("*.*")}
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, limits[1]))
    try:
        with pytest.raises(ExportError, match="bag cannot be written"):
            export_run(run, "rosbag2", out, force=there)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert {path: path.read_bytes() for path in tmp_path.rglob("*.*")} == before


@pytest.mark.parametrize("name", ["a#b", "a?b", "a%20b"])
def test_path_that_rosbags_would_misread_is_refused(run, tmp_path, name):
    with pytest.raises(ExportError, match=r"expected a path without \?, # and %"):
        export_run(run, "rosbag2", tmp_path / name)
    assert not list(tmp_path.iterdir())
