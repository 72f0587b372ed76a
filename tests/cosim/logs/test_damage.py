"""Logs of every format with bytes that are missing, zero or foreign somewhere: what is sound is read, and only that."""

import bz2
import functools
import struct
from io import BytesIO

import numpy as np
import pytest

from cosim.logs.frames import euler_zyx
from cosim.results.log_facts import load_log_facts
from tests.cosim.logs import test_bags
from tests.cosim.logs.conftest import LOGS
from tests.cosim.logs.dive import Dive
from tests.cosim.logs.test_px4_logs import write_ulog

rosbag1 = pytest.importorskip("rosbags.rosbag1")
writer, reader = pytest.importorskip("mcap.writer"), pytest.importorskip("mcap.reader")
DIVE = Dive(np.arange(0.0, 30.0, 0.05))
TABLE = "t,yaw,pitch,roll\n" + "".join(
    f"{t:.3f},{a:.5f},{b:.5f},{c:.5f}\n" for t, a, b, c in zip(DIVE.times, DIVE.yaw, DIVE.pitch, DIVE.roll, strict=True)
)
TABLE_MAP = 'time = { column = "t" }\n[attitude]\ncolumns = ["yaw", "pitch", "roll"]\neuler = "ZYX"\n'


def plain_mcap(path, dive):
    """A file without chunks."""
    test_bags.write_bag(path, dive)
    whole = BytesIO(path.read_bytes())
    with path.open("wb") as file:
        bag, channels = writer.Writer(file, use_chunking=False), {}
        bag.start()
        for schema, channel, message in reader.make_reader(whole).iter_messages():
            if channel.id not in channels:
                kind = bag.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = bag.register_channel(channel.topic, channel.message_encoding, kind)
            bag.add_message(channels[channel.id], message.log_time, message.data, message.publish_time)
        bag.finish()


def packed_ros1(path, dive):
    """A bag with compressed chunks of a few seconds each."""
    bag = rosbag1.Writer(path)
    bag.chunk_threshold = 50_000
    bag.set_compression(bag.CompressionFormat.BZ2)
    test_bags.write_by_rosbags(bag, dive, test_bags.typesys.Stores.ROS1_NOETIC, "serialize_ros1")


WRITE = {  # format: writer, and map; a part of the samples that damage in one place may cost
    "csv": (lambda path, dive: path.write_text(TABLE), TABLE_MAP, 0.02),
    "ulg": (write_ulog, None, 0.02),
    "mcap": (test_bags.write_bag, test_bags.MAP, 0.1),
    "plain.mcap": (plain_mcap, test_bags.MAP, 0.02),
    "bag": (test_bags.write_ros1, test_bags.MAP, 0.02),
    "packed.bag": (packed_ros1, test_bags.MAP, 0.3),
}


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    @functools.cache
    def content(suffix):
        path = tmp_path_factory.mktemp("sound") / f"it.{suffix}"
        WRITE[suffix][0](path, DIVE)
        return path.read_bytes()

    return content


def damaged(content, kind, seed):
    """Cut, zero, overwrite or insert up to 300 bytes somewhere behind the head of a file."""
    rng = np.random.default_rng(seed)
    at, count = int(rng.uniform(0.08, 0.92) * len(content)), int(rng.integers(1, 300))
    middle = {"cut": b"", "zero": bytes(count), "foreign": rng.bytes(count), "insert": rng.bytes(count)}[kind]
    return content[:at] + middle + content[at + (0 if kind == "insert" else count) :]


@pytest.mark.medium(fast=6)
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", ["cut", "zero", "foreign", "insert"])
@pytest.mark.parametrize("suffix", WRITE)
def test_what_is_sound_is_read_before_and_after_damage(sound, suffix, kind, seed, tmp_path, imported):
    path = tmp_path / f"it.{suffix}"
    path.write_bytes(damaged(sound(suffix), kind, seed))
    _, columns, cost = WRITE[suffix]
    if columns:
        (tmp_path / "map.toml").write_text(columns)
    run = imported(path, columns=tmp_path / "map.toml" if columns else None)
    facts = {topic.quantity: topic for topic in load_log_facts(run.folder).topics}
    assert (1.0 - cost) * len(DIVE.times) - 2 <= facts["attitude"].samples <= len(DIVE.times)
    assert run.summary["simulated_time"] == pytest.approx(DIVE.times[-1], abs=0.3 if cost < 0.2 else 9.0)
    record = run.record
    angles = euler_zyx(record.stack([f"quaternion.e{i}" for i in range(4)]))
    known = np.isfinite(angles).all(axis=1)
    expected = np.column_stack([np.interp(record["time"], DIVE.times, x) for x in (DIVE.roll, DIVE.pitch, DIVE.yaw)])
    assert np.mean(np.abs(angles - expected)[known].max(axis=1) > 0.02) < 0.01 and known.mean() > 0.9 - cost


@pytest.mark.medium
def test_damage_in_real_logs_costs_what_it_covers(tmp_path, imported, six_thrusters):
    for name, vehicle in (("small.tlog", "bluerov2_heavy"), ("small.BIN", six_thrusters)):
        content = (LOGS / name).read_bytes()
        whole = {t.quantity: t.samples for t in load_log_facts(imported(LOGS / name, vehicle).folder).topics}
        for kind in ("cut", "insert"):  # zeros in a message are no damage that can be seen
            (tmp_path / name).write_bytes(damaged(content, kind, 5))
            left = load_log_facts(imported(tmp_path / name, vehicle).folder)
            assert any("are damaged and were passed over" in remark for remark in left.remarks)
            assert all(t.samples >= 0.97 * whole[t.quantity] for t in left.topics) and len(left.topics) == len(whole)


def test_bag_without_its_index_and_with_a_lost_connection_is_read(sound, tmp_path, columns_of_bag, imported):
    """A recorder that was killed writes no index; and a connection that is damaged is found in the index."""
    content = sound("bag")
    index = struct.unpack("<Q", content[content.index(b"index_pos=") + 10 :][:8])[0]
    (tmp_path / "it.bag").write_bytes(content[:index])
    assert len(imported(tmp_path / "it.bag", columns=columns_of_bag).record) == len(DIVE.times)
    at = content.index(b"topic=/odom")
    (tmp_path / "it.bag").write_bytes(content[:at] + bytes(11) + content[at + 11 :])
    assert len(imported(tmp_path / "it.bag", columns=columns_of_bag).record) >= len(DIVE.times) - 1


@pytest.mark.parametrize(
    ("content", "what"),
    [
        (b"#ROSBAG V1.2\n" + bytes(100), "is a bag of version 1.2, expected 2.0"),
        (b"no bag" * 1000, "cannot be read as a bag: it does not begin as one"),
        (bz2.compress(b"x") * 9, "cannot be read as a bag"),
    ],
)
def test_what_is_no_bag_of_ros_1_is_refused(content, what, tmp_path, columns_of_bag, refused):
    (tmp_path / "it.bag").write_bytes(content)
    refused(what, tmp_path / "it.bag", columns=columns_of_bag)


def test_bag_without_messages_is_refused(tmp_path, refused):
    with (tmp_path / "it.mcap").open("wb") as file:
        bag = writer.Writer(file)
        bag.start()
        bag.finish()
    refused("holds no message", tmp_path / "it.mcap")


@pytest.fixture
def columns_of_bag(tmp_path):
    (tmp_path / "map.toml").write_text(test_bags.MAP)
    return tmp_path / "map.toml"
