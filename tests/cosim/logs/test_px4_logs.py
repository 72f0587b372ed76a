"""Logs of PX4, read beside pyulog."""

import contextlib
import io
import struct
import tracemalloc

import numpy as np
import pytest

from cosim.logs import records
from cosim.logs.formats import ulog_messages
from cosim.logs.formats.ulog_messages import ULogMessages
from cosim.results.log_facts import load_log_facts
from tests.cosim.logs.dive import Dive, assert_flown

pyulog = pytest.importorskip("pyulog")

SYNC = bytes.fromhex("2f731320250cbb12")
TOPICS = frozenset({"vehicle_attitude", "vehicle_local_position", "actuator_motors", "battery_status"})


@pytest.fixture(scope="module")
def dive():
    return Dive(np.arange(0.0, 30.0, 0.05))


def message(kind, body):
    return struct.pack("<HB", len(body), ord(kind)) + body


def write_ulog(path, dive):
    """A log of PX4, byte by byte as its format is described; pyulog must read it as well."""
    formats = {
        "vehicle_attitude": "uint64_t timestamp;float[4] q;",
        "vehicle_local_position": "uint64_t timestamp;float x;float y;float z;float vx;float vy;float vz;",
        "actuator_motors": "uint64_t timestamp;float[8] control;",
        "something_else": "uint64_t timestamp;float a;",
        "battery_status": "uint64_t timestamp;cell[2] cells;float voltage_v;uint8_t warning;uint8_t[3] _padding0;",
        "cell": "uint16_t charge;int32_t[2] raw;",
    }

    with path.open("wb") as file:
        file.write(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 5_000_000))
        file.write(message("B", bytes(40)))
        for name, fields in formats.items():
            file.write(message("F", f"{name}:{fields}".encode()))
        key = b"int32_t MAV_TYPE"
        file.write(message("P", bytes([len(key)]) + key + struct.pack("<i", 12)))
        for number, name in enumerate(list(formats)[:-1]):
            file.write(message("A", struct.pack("<BH", 0, number) + name.encode()))
        for k, t in enumerate(dive.times):
            stamp = struct.pack("<Q", 5_000_000 + round(1e6 * t))
            rows = (dive.quaternion[k], [*dive.position[k], *dive.velocity_world[k]], dive.thrust[k] / 40.0, [1.0])
            for number, values in enumerate(rows):
                data = struct.pack("<H", number) + stamp + struct.pack(f"<{len(values)}f", *values)
                file.write(message("D", data))
            cells = struct.pack("<HiiHii", 1, 2, 3, 4, 5, k)
            file.write(message("D", struct.pack("<H", 4) + stamp + cells + struct.pack("<fB", 15.0 + 0.01 * k, 1)))
            if k % 50 == 0:
                file.write(message("S", SYNC))


@pytest.fixture
def path(dive, tmp_path):
    write_ulog(tmp_path / "dive.ulg", dive)
    return tmp_path / "dive.ulg"


def test_imported_px4_log_matches_the_dive(dive, path, imported):
    run = imported(path)
    assert_flown(run.record, dive, 2e-6, known=1.0)
    assert run.summary["law"] == "px4"
    assert "something_else" in load_log_facts(run.folder).unread


def test_truncated_px4_log_is_read_to_its_end(path, imported):
    data = path.read_bytes()
    path.write_bytes(data[: int(0.6 * len(data))])
    assert 15.0 < imported(path).summary["simulated_time"] < 19.0


def read_samples(path):
    """The reader, and all samples of the file's topics."""
    ours = {}
    log = ULogMessages(path, TOPICS)
    for name, block in log.blocks():
        ours.setdefault(name, []).append(block)
    return log, {name: np.concatenate(blocks) for name, blocks in ours.items()}


def samples_of(path):
    """As the reader and as pyulog have them."""
    with contextlib.redirect_stdout(io.StringIO()):
        theirs = pyulog.ULog(str(path), list(TOPICS))
    return *read_samples(path), theirs


def assert_equal_samples(ours, theirs):
    assert set(ours) == {f"{data.name}[{data.multi_id}]" for data in theirs.data_list}
    for data in theirs.data_list:
        for field, values in data.data.items():
            np.testing.assert_array_equal(ours[f"{data.name}[{data.multi_id}]"][field], values)


def test_samples_are_those_of_pyulog(dive, path):
    """Types in types, arrays, and padding at the end, block by block."""
    log, ours, theirs = samples_of(path)
    assert_equal_samples(ours, theirs)
    assert log.parameters == {"MAV_TYPE": 12.0} == theirs.initial_parameters
    assert not log.lost and ours["battery_status[0]"]["cells[1].raw[1]"][-1] == len(dive.times) - 1


def test_data_appended_after_a_crash_are_read(path):
    """The message that the crash cut ends where the appended data begin."""
    _, _, theirs = samples_of(path)
    whole = path.read_bytes()
    middle = whole.index(struct.pack("<HB", 8, ord("S")) + SYNC, len(whole) // 2)
    data = bytearray(whole[:middle] + struct.pack("<HB", 100, ord("D")) + bytes(20) + whole[middle:])
    data[16 + 3 + 8] = 1  # the flag of appended data
    data[16 + 3 + 16 : 16 + 3 + 24] = struct.pack("<Q", middle + 23)
    path.write_bytes(data)
    log, ours, _ = samples_of(path)
    assert_equal_samples(ours, theirs)
    assert log.lost == 23


def test_reading_goes_on_behind_damage(path):
    data = bytearray(path.read_bytes())
    at = len(data) // 2
    data[at : at + 300] = bytes(300)
    path.write_bytes(data)
    log, ours, theirs = samples_of(path)
    assert log.lost and theirs.file_corruption
    for data in theirs.data_list:
        found = ours[f"{data.name}[{data.multi_id}]"]
        assert found["timestamp"][-1] == data.data["timestamp"][-1]
        assert abs(len(found) - len(data.data["timestamp"])) < 60


@pytest.mark.parametrize("junk", [bytes(300_000), np.random.default_rng(3).bytes(300_000)], ids=["zeros", "random"])
def test_junk_behind_a_log_leaves_what_came_before(path, junk):
    _, _, theirs = samples_of(path)
    path.write_bytes(path.read_bytes() + message("O", b"\1\0") + junk)
    log, ours = read_samples(path)
    assert log.lost
    assert_equal_samples(ours, theirs)


def test_nested_formats_are_bounded(tmp_path):
    """Types without fields, and types whose arrays multiply, are damage."""
    levels = [f"{name}:{of}[4000] a;".encode() for name, of in zip(["vehicle_attitude", *"ABCD"], "ABCDE", strict=True)]
    for last in (b"E:", b"E:float x;"):
        formats = [message("F", text) for text in (*levels, last)]
        subscription = message("A", b"\0\0\0vehicle_attitude")
        (tmp_path / "deep.ulg").write_bytes(b"ULog\x01\x12\x35\x01" + bytes(8) + b"".join(formats) + subscription)
        log = ULogMessages(tmp_path / "deep.ulg", frozenset(["vehicle_attitude"]))
        assert not list(log.blocks()) and log.lost


@pytest.mark.medium
def test_memory_does_not_grow_with_the_log(path, monkeypatch):
    """Samples are given in blocks: a log of four times the length needs the same memory."""
    monkeypatch.setattr(records, "_WINDOW", 1 << 15)
    monkeypatch.setattr(ulog_messages, "_BLOCK", 1 << 10)
    whole = path.read_bytes()
    section = whole[whole.index(struct.pack("<HB", 8, ord("S")) + SYNC) :]

    def peak(times):
        path.write_bytes(whole + times * section)
        tracemalloc.start()
        for _ in ULogMessages(path, TOPICS).blocks():
            pass
        found = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return found

    assert peak(4) < 1.2 * peak(1)
