"""Logs of PX4, read beside pyulog."""

import struct

import numpy as np
import pytest

import cosim
from cosim.results.log_facts import load_log_facts
from tests.cosim.logs.dive import Dive, errors

pyulog = pytest.importorskip("pyulog")


@pytest.fixture(scope="module")
def dive():
    return Dive(np.arange(0.0, 30.0, 0.05))


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
