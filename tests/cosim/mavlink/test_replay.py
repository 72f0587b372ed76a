"""A recorded run streamed over MAVLink: complete, equal to the record, and read-only."""

import shutil
import struct
import threading

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from pymavlink.dialects.v20 import all as mavlink

from cosim.command_line.cli import main
from cosim.errors import RunError
from cosim.mavlink.replay import replay
from cosim.mavlink.wire.endpoint import parse_endpoint
from cosim.mavlink.wire.options import MavlinkOptions
from cosim.results.record import load_record
from tests.cosim.mavlink.running import GroundStation

OVERRIDES = ("arbiter.engine=closed", "time.duration=4")
COMMANDED = (*OVERRIDES, "commands.enabled=true")


def frames(log):
    """Yield stamps and messages of a .tlog."""
    data, codec, at = log.read_bytes(), mavlink.MAVLink(None), 0
    while at < len(data):
        (stamp,) = struct.unpack_from(">Q", data, at)
        size = data[at + 9] + 12
        yield stamp, codec.decode(bytearray(data[at + 8 : at + 8 + size]))
        at += 8 + size


@pytest.fixture(scope="module")
def recorded(shipped_run):
    return shipped_run("paper-limited", *OVERRIDES).folder


@pytest.fixture(scope="module")
def logged(recorded, tmp_path_factory):
    log = tmp_path_factory.mktemp("log") / "run.tlog"
    done = replay(recorded, [parse_endpoint(str(log))], MavlinkOptions(), rate=None)
    return done, list(frames(log))


@pytest.mark.medium
def test_unlimited_rate_drops_no_message(logged):
    done, messages = logged
    assert done.simulated == pytest.approx(4.0) and done.loss_reports == []
    stamps = [m.time_boot_ms for _, m in messages if m.get_type() == "ATTITUDE"]
    assert stamps == list(range(0, 4001, 100))
    sequence = [m.get_seq() for _, m in messages]
    assert sequence == [i % 256 for i in range(len(sequence))]


def test_streamed_values_equal_the_record(logged, recorded):
    record = load_record(recorded)
    time, position = record["time"], record.stack(["position.x", "position.y", "position.z"])
    came = [m for _, m in logged[1] if m.get_type() == "LOCAL_POSITION_NED"]
    assert len(came) == 41
    for message in came:
        (k,) = np.flatnonzero(np.isclose(time, 1e-3 * message.time_boot_ms))
        np.testing.assert_allclose([message.x, message.y, message.z], position[k], rtol=1e-6)


def test_log_timestamps_advance_in_real_time(logged):
    attitudes = [(stamp, m.time_boot_ms) for stamp, m in logged[1] if m.get_type() == "ATTITUDE"]
    wall = (attitudes[-1][0] - attitudes[0][0]) * 1e-6
    assert wall == pytest.approx(4.0, abs=0.02)


@pytest.mark.slow
def test_commanded_run_is_streamed(shipped_run, tmp_path):
    log = tmp_path / "run.tlog"
    folder = shipped_run("paper-limited", *COMMANDED).folder
    done = replay(folder, [parse_endpoint(str(log))], MavlinkOptions(profile="px4"), rate=None)
    assert done.loss_reports == []
    beats = [m for _, m in frames(log) if m.get_type() == "HEARTBEAT"]
    assert {b.autopilot for b in beats} == {mavlink.MAV_AUTOPILOT_PX4}
    assert beats[0].base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED


def test_killed_run_is_streamed_to_its_last_row(recorded, tmp_path):
    killed = tmp_path / "killed"
    killed.mkdir()
    shutil.copy(recorded / "scenario.toml", killed)
    table = pq.read_table(recorded / "record.parquet")
    with pa.ipc.new_stream(killed / "record.arrows", table.schema) as stream:
        stream.write_table(table)
    done = replay(killed, [parse_endpoint(str(tmp_path / "run.tlog"))], MavlinkOptions(), rate=None)
    assert done.simulated == pytest.approx(4.0)


@pytest.mark.slow
def test_streaming_over_udp_answers_requests_and_rejects_commands(recorded):
    done = []
    with GroundStation() as station:
        thread = threading.Thread(target=lambda: done.append(replay(recorded, [station.endpoint], MavlinkOptions())))
        thread.start()
        station.connect()
        assert station.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM).result == mavlink.MAV_RESULT_DENIED
        thread.join()
    assert done[0].wall >= 4.0


def test_stream_command_writes_a_log_and_reports_it(recorded, tmp_path, capsys):
    log = tmp_path / "run.tlog"
    assert main(["mavlink", "stream", str(recorded), "--mavlink", str(log), "--rate", "max"]) == 0
    assert "4.0 s streamed" in capsys.readouterr().out
    assert log.stat().st_size > 10_000


def test_missing_run_gives_one_line_error(recorded, tmp_path, capsys):
    assert main(["mavlink", "stream", str(tmp_path), "--mavlink", str(tmp_path / "a.tlog")]) == 2
    assert "holds no run (scenario.toml is missing)" in capsys.readouterr().err
    shutil.copy(recorded / "scenario.toml", tmp_path)
    with pytest.raises(RunError, match="holds no record"):
        replay(tmp_path, [parse_endpoint(str(tmp_path / "b.tlog"))], MavlinkOptions())
    assert not list(tmp_path.glob("*.tlog"))


def test_foreign_record_is_rejected(recorded, tmp_path):
    shutil.copy(recorded / "scenario.toml", tmp_path)
    pq.write_table(pa.table({"time": [0.0, 0.1]}), tmp_path / "record.parquet")
    with pytest.raises(RunError, match=r"no columns 'position\.x'"):
        replay(tmp_path, [parse_endpoint(str(tmp_path / "b.tlog"))], MavlinkOptions())
