"""Bags of ROS 2, written by mcap-ros2-support and rosbags, one of a recorder of ROS 2, and a bag of ROS 1."""

import contextlib
import shutil
import sqlite3
import sys
import tomllib
import tracemalloc

import numpy as np
import pytest
import tomli_w
from scipy.spatial.transform import Rotation

from cosim.command_line.cli import main
from cosim.logs.bag_storage import stored_messages
from cosim.logs.formats.bag import Decoder
from cosim.results.log_facts import load_log_facts
from tests.cosim.logs.conftest import LOGS, changed, has_remark
from tests.cosim.logs.dive import Dive, assert_flown

zstandard = pytest.importorskip("zstandard")
writer = pytest.importorskip("mcap_ros2.writer")
rosbag1 = pytest.importorskip("rosbags.rosbag1")
rosbag2 = pytest.importorskip("rosbags.rosbag2")
typesys = pytest.importorskip("rosbags.typesys")

ODOMETRY, _ = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE).generate_msgdef("nav_msgs/msg/Odometry", ros_version=2)
FORCES = "float64[] data\n"
STAMP = {"column": "header.stamp"}
TABLE = {
    "world": "ENU", "body": "FLU",
    "position": {"topic": "/odom", "columns": [f"pose.pose.position.{a}" for a in "xyz"], "time": STAMP},
    "attitude": {"topic": "/odom", "columns": [f"pose.pose.orientation.{a}" for a in "xyzw"], "quaternion": "xyzw",
                 "time": STAMP},
    "velocity": {"topic": "/odom", "columns": [f"twist.twist.linear.{a}" for a in "xyz"], "time": STAMP},
    "thrust": {"topic": "/thrusters", "columns": [f"data[{i}]" for i in range(8)]},
}  # fmt: skip
MAP = tomli_w.dumps(TABLE)
START = 1_700_000_000


def messages_of(dive):
    """Yield topic, message and time [ns]: odometry at 20 Hz in ENU and FLU, and forces; each 80 ms after its stamp."""
    swap = Rotation.from_matrix([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
    flip = Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))
    R = Rotation.from_quat(dive.quaternion, scalar_first=True)
    positions, velocities = swap.apply(dive.position), flip.apply(R.inv().apply(dive.velocity_world))
    quaternions, covariance = (swap * R * flip).as_quat(), [0.0] * 36
    for k, t in enumerate(dive.times):
        stamp = round(1e9 * t)
        position, linear = dict(zip("xyz", positions[k], strict=True)), dict(zip("xyz", velocities[k], strict=True))
        pose = {"position": position, "orientation": dict(zip("xyzw", quaternions[k], strict=True))}
        twist = {"linear": linear, "angular": dict.fromkeys("xyz", 0.0)}
        odometry = {
            "header": {"stamp": {"sec": START + stamp // 10**9, "nanosec": stamp % 10**9}, "frame_id": "odom"},
            "child_frame_id": "base_link", "pose": {"pose": pose, "covariance": covariance},
            "twist": {"twist": twist, "covariance": covariance},
        }  # fmt: skip
        yield "/odom", odometry, START * 10**9 + stamp + 80_000_000
        yield "/thrusters", {"data": dive.thrust[k].tolist()}, START * 10**9 + stamp
        yield "/else", {"data": []}, START * 10**9 + stamp


def write_bag(path, dive):
    with path.open("wb") as file:
        bag = writer.Writer(file, chunk_size=20_000)
        kinds = {"/odom": bag.register_msgdef("test_msgs/msg/Odometry", ODOMETRY)}
        kinds["/thrusters"] = kinds["/else"] = bag.register_msgdef("test_msgs/msg/Forces", FORCES)
        for topic, message, time in messages_of(dive):
            bag.write_message(topic, kinds[topic], message, log_time=time)
        bag.finish()


def made(store, name, values):
    """Return a message of rosbags from nested dictionaries."""
    kinds, fields = dict(store.fielddefs[name][1]), {"seq": 0} if name == "std_msgs/msg/Header" else {}
    for field, value in values.items():
        if isinstance(value, dict):
            fields[field] = made(store, kinds[field][1], value)
        else:
            fields[field] = np.array(value, float) if isinstance(value, list) else value
    return store.types[name](**{field: fields[field] for field in kinds})


TYPES = {"/odom": "test_msgs/msg/Odometry", "/thrusters": "test_msgs/msg/Forces", "/else": "test_msgs/msg/Forces"}


def write_by_rosbags(bag, dive, distribution, serialize):
    store = typesys.get_typestore(distribution)
    types = typesys.get_types_from_msg(FORCES, "test_msgs/msg/Forces")
    types |= typesys.get_types_from_msg(ODOMETRY, "test_msgs/msg/Odometry")
    store.register({name: fields for name, fields in types.items() if name not in store.types})
    with bag:
        topics = {topic: bag.add_connection(topic, name, typestore=store) for topic, name in TYPES.items()}
        for topic, message, time in messages_of(dive):
            name = TYPES[topic]
            bag.write(topics[topic], time, getattr(store, serialize)(made(store, name, message), name))


def write_database(folder, dive):
    """Write a bag of SQLite as a folder; return the path of its database."""
    write_by_rosbags(rosbag2.Writer(folder, version=8), dive, typesys.Stores.ROS2_HUMBLE, "serialize_cdr")
    return folder / f"{folder.name}.db3"


def write_ros1(path, dive):
    write_by_rosbags(rosbag1.Writer(path), dive, typesys.Stores.ROS1_NOETIC, "serialize_ros1")


def change(path, script):
    """Run a script of SQL on a database."""
    with contextlib.closing(sqlite3.connect(path)) as database:
        database.executescript(script)


def split(path, folder):
    """Copy a database as a folder of two, as a recorder writes with a greatest duration; the second has number 10."""
    folder.mkdir()
    for number, other in ((9, ">"), (10, "<=")):
        part = shutil.copyfile(path, folder / f"dive_{number}.db3")
        change(part, f"DELETE FROM messages WHERE id {other} {3 * 300}")
    return folder


@pytest.fixture(scope="module")
def dive():
    return Dive(np.arange(0.0, 30.0, 0.05))


@pytest.fixture(scope="module")
def bag(tmp_path_factory, dive):
    path = tmp_path_factory.mktemp("bag") / "dive.mcap"
    write_bag(path, dive)
    return path


def compress_messages(path):
    with contextlib.closing(sqlite3.connect(path)) as database:
        for key, data in database.execute("SELECT id, data FROM messages").fetchall():
            packed = zstandard.ZstdCompressor().compress(data)
            database.execute("UPDATE messages SET data = ? WHERE id = ?", (packed, key))
        database.commit()
    return path


def kill_recorder(path, folder):
    """Copy a database with its journal, which corrects the name of a topic, as a killed recorder leaves them."""
    change(path, "UPDATE topics SET name = '/unnamed' WHERE name = '/odom'")
    with contextlib.closing(sqlite3.connect(path)) as database:
        database.execute("PRAGMA journal_mode = WAL")
        database.execute("UPDATE topics SET name = '/odom' WHERE name = '/unnamed'")
        database.commit()
        folder.mkdir()
        for file in (path, path.with_name(f"{path.name}-wal")):
            shutil.copyfile(file, folder / file.name)
    return folder / path.name


@pytest.fixture(scope="module")
def bags(tmp_path_factory, dive, bag):
    """The same dive in every storage."""
    folder = tmp_path_factory.mktemp("bags")
    database = write_database(folder / "whole", dive)
    write_ros1(folder / "dive.bag", dive)
    old = shutil.copyfile(database, folder / "old.db3")
    change(old, "DROP TABLE message_definitions; UPDATE schema SET schema_version = 3;")
    early = shutil.copyfile(old, folder / "early.db3")
    change(early, "UPDATE topics SET type = replace(type, '/msg/', '/')")
    return {
        "MCAP": bag,
        "SQLite": database,
        "folder": database.parent,
        "two files": split(database, folder / "two"),
        "compressed messages": compress_messages(shutil.copyfile(database, folder / "packed.db3")),
        "journal": kill_recorder(shutil.copyfile(database, folder / "killed.db3"), folder / "killed"),
        "no definitions": old,
        "short names of types": early,
        "ROS 1": folder / "dive.bag",
    }


@pytest.fixture
def columns(tmp_path):
    """A column map beside the definitions of its messages."""
    package = tmp_path / "share" / "test_msgs" / "msg"
    package.mkdir(parents=True)
    (package / "Odometry.msg").write_text(ODOMETRY.partition("===")[0])
    (package / "Forces.msg").write_text(FORCES)
    (tmp_path / "map.toml").write_text('messages = "share"\n' + MAP)
    return tmp_path / "map.toml"


@pytest.mark.parametrize(
    "storage",
    ["MCAP", "SQLite", "folder", "two files", "compressed messages", "journal", "no definitions",
     "short names of types", "ROS 1"],
)  # fmt: skip
def test_imported_bag_matches_the_dive(bags, storage, columns, dive, imported):
    run = imported(bags[storage], columns=columns)
    assert_flown(run.record, dive, 1e-6)
    facts = load_log_facts(run.folder)
    assert facts.unread == {"/else": len(dive.times)}
    assert facts.start == pytest.approx(START, abs=1e-3)


def test_bag_of_a_recorder_is_read():
    """By ros2 bag record 0.3; values as ``ros2 bag`` of its own tests expects them."""
    fractions = []
    messages = list(stored_messages(LOGS / "cdr_test_0.db3", [], fractions.append))
    assert [message.topic for message in messages].count("/test_topic") == 3
    assert 0.0 < fractions[0] < fractions[-1] < 1.0
    decoder = Decoder("")
    basic = [decoder.decode(message) for message in messages if message.topic == "/test_topic"]
    assert {message.int32_value for message in basic} == {123}
    arrays = [decoder.decode(message) for message in messages if message.topic == "/array_topic"]
    assert all(message.bool_values.tolist() == [True, False, True] for message in arrays) and len(arrays) == 4


@pytest.mark.parametrize(
    ("files", "what"),
    [
        ([], "is a folder without a bag, expected files that end in .mcap, .db3, .bag"),
        (["a_0.db3.zstd"], "holds 'a_0.db3.zstd', which is compressed as a whole"),
        (["a.db3", "a.mcap"], "is a folder of bags of two kinds"),
        (["a.db3"], "cannot be read as a bag: file is not a database"),
        (["a.bag"], "cannot be read as a bag"),
    ],
)
def test_folders_without_a_bag_are_refused(files, what, columns, tmp_path, refused):
    folder = tmp_path / "bag"
    folder.mkdir()
    for name in files:
        (folder / name).write_bytes(b"no bag at all" * 100)
    refused(what, folder, columns=columns)


def test_type_without_definition_is_named(bags, columns, tmp_path, refused):
    bad = tmp_path / "bad" / "test_msgs"
    bad.mkdir(parents=True)
    (bad / "Odometry.msg").write_text("float64 x[\n")
    for folder, what in (
        ("", r"of type test_msgs/msg/\w+, which the bag does not define; .*messages"),
        ('messages = "nowhere"\n', r"messages is '.*nowhere', expected a folder"),
        ('messages = "bad"\n', r"messages: .*Odometry\.msg is no message definition"),
    ):
        columns.write_text(folder + MAP)
        refused(what, bags["no definitions"], columns=columns)


def test_truncated_bag_is_read_to_its_end(bag, columns, tmp_path, imported):
    data = bag.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) // 2])
    run = imported(tmp_path / "cut.mcap", columns=columns)
    assert has_remark(run, "breaks off")
    assert 0.0 < run.summary["simulated_time"] < 20.0


def test_damage_is_passed_over_without_loading_the_rest_of_a_file(bag, tmp_path):
    """A hole of 64 MiB between two halves of a bag."""
    data = bag.read_bytes()
    with (tmp_path / "large.mcap").open("wb") as file:
        file.write(data[: len(data) // 2])
        file.seek(1 << 26)
        file.write(data[len(data) // 2 :])
    tracemalloc.start()
    remarks = []
    count = sum(1 for _ in stored_messages(tmp_path / "large.mcap", remarks, lambda fraction: None))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert count > 1500 and "bytes of large.mcap are damaged" in remarks[0] and peak < 1 << 24


def test_bag_whose_topics_come_one_after_the_other_is_read(tmp_path, columns, dive, imported):
    """And whose chunks are out of order in time, as of a converter."""
    with (tmp_path / "dive.mcap").open("wb") as file:
        made_bag = writer.Writer(file, chunk_size=20_000)
        kinds = {"/odom": made_bag.register_msgdef("test_msgs/msg/Odometry", ODOMETRY)}
        kinds["/thrusters"] = kinds["/else"] = made_bag.register_msgdef("test_msgs/msg/Forces", FORCES)
        for topic, message, time in sorted(messages_of(dive), key=lambda entry: entry[0]):
            made_bag.write_message(topic, kinds[topic], message, log_time=time)
        made_bag.finish()
    assert_flown(imported(tmp_path / "dive.mcap", columns=columns).record, dive, 1e-6)


def test_topics_of_a_bag_without_a_map_are_drafted(bag, tmp_path, capsys):
    assert main(["import", str(bag), "--vehicle", "bluerov2_heavy", "--out", str(tmp_path / "run")]) == 2
    draft = capsys.readouterr().out
    assert "# /odom (20 messages per second)" in draft and "pose.pose.position.x" in draft
    table = tomllib.loads(draft)
    assert table["position"] == {key: TABLE["position"][key] for key in ("topic", "columns")}
    assert table["attitude"]["columns"] == [f"pose.pose.orientation.{a}" for a in "wxyz"]


POSITION = TABLE["position"]["columns"][:2]


@pytest.mark.parametrize(
    ("key", "value", "what"),
    [
        ("thrust.topic", "/thruster", "has no topic '/thruster', .*did you mean '/thrusters'"),
        ("thrust.topic", None, r"the map says no topic for \[thrust\]"),
        ("position.columns", [*POSITION, "pose.pose.position.zz"], r"/odom has no field 'pose\.pose\.position\.zz'"),
        ("position.columns", [*POSITION, "header.frame_id"], "/odom: header.frame_id is str, expected a number"),
        ("position.columns", [*POSITION, "pose position"], "is no path, expected one such as"),
        ("thrust.columns", [*TABLE["thrust"]["columns"][:7], "data[8]"], r"/thrusters has no field 'data\[8\]'"),
    ],
)
def test_missing_bag_topics_are_named(bag, columns, refused, key, value, what):
    columns.write_text(changed(TABLE, key, value))
    refused(what, bag, columns=columns)


def test_missing_library_is_reported(bag, columns, monkeypatch, refused):
    for name in ("rosbags", "rosbags.typesys"):
        monkeypatch.setitem(sys.modules, name, None)
    refused(r"needs rosbags.*pip install", bag, columns=columns)
