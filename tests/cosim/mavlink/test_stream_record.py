"""A recorded run streamed over MAVLink: complete, equal to the record, and read-only."""

import shutil
import threading

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from pymavlink.dialects.v20 import all as mavlink

from cosim.command_line.cli import main
from cosim.errors import RunError
from cosim.mavlink.stream_record import stream_record
from cosim.mavlink.wire.endpoint import parse_endpoint
from cosim.mavlink.wire.options import MavlinkOptions
from cosim.results.record import load_record
from tests.cosim.mavlink.running import GroundStation
from tests.cosim.mavlink.stubs import read_log

OVERRIDES = ("arbiter.engine=closed", "time.duration=4")


def replayed(folder, log, **options):
    """Stream a run into a log; return the result, and the messages."""
    result = stream_record(folder, [parse_endpoint(str(log))], MavlinkOptions(**options), rate=None)
    return result, read_log(log)


@pytest.fixture(scope="module")
def recorded(shipped_run):
    return shipped_run("paper-limited", *OVERRIDES).folder


@pytest.fixture(scope="module")
def logged(recorded, tmp_path_factory):
    return replayed(recorded, tmp_path_factory.mktemp("log") / "run.tlog")


@pytest.mark.medium
def test_unlimited_rate_drops_no_message_and_stamps_in_real_time(logged):
    done, messages = logged
    assert done.simulated == pytest.approx(4.0) and done.loss_reports == []
    attitudes = [m for m in messages if m.get_type() == "ATTITUDE"]
    assert [m.time_boot_ms for m in attitudes] == list(range(0, 4001, 100))
    assert attitudes[-1]._timestamp - attitudes[0]._timestamp == pytest.approx(4.0, abs=0.02)
    assert [m.get_seq() for m in messages] == [i % 256 for i in range(len(messages))]


def test_streamed_values_equal_the_record(logged, recorded):
    record = load_record(recorded)
    sent = [m for m in logged[1] if m.get_type() == "LOCAL_POSITION_NED"]
    rows = np.searchsorted(record["time"], [1e-3 * m.time_boot_ms - 1e-6 for m in sent])
    expected = record.stack(["time", "position.x", "position.y", "position.z"])[rows]
    assert len(sent) == 41
    np.testing.assert_allclose([[1e-3 * m.time_boot_ms, m.x, m.y, m.z] for m in sent], expected, rtol=1e-6, atol=1e-9)


@pytest.mark.slow
def test_commanded_run_is_streamed(shipped_run, tmp_path):
    folder = shipped_run("paper-limited", *OVERRIDES, "commands.enabled=true").folder
    done, messages = replayed(folder, tmp_path / "run.tlog", profile="px4")
    assert done.loss_reports == []
    beats = [m for m in messages if m.get_type() == "HEARTBEAT"]
    assert {b.autopilot for b in beats} == {mavlink.MAV_AUTOPILOT_PX4}
    assert beats[0].base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED


def test_killed_run_is_streamed_to_its_last_row(recorded, tmp_path):
    shutil.copy(recorded / "scenario.toml", tmp_path)
    table = pq.read_table(recorded / "record.parquet")
    with pa.ipc.new_stream(tmp_path / "record.arrows", table.schema) as stream:
        stream.write_table(table)
    assert replayed(tmp_path, tmp_path / "run.tlog")[0].simulated == pytest.approx(4.0)


@pytest.mark.slow
def test_streaming_over_udp_answers_requests_and_rejects_commands(recorded):
    done = []
    with GroundStation() as station:
        thread = threading.Thread(
            target=lambda: done.append(stream_record(recorded, [station.endpoint], MavlinkOptions()))
        )
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


def test_missing_or_foreign_record_gives_one_line_error(recorded, tmp_path, capsys):
    log = tmp_path / "a.tlog"
    assert main(["mavlink", "stream", str(tmp_path), "--mavlink", str(log)]) == 2
    assert "holds no run (scenario.toml is missing)" in capsys.readouterr().err
    shutil.copy(recorded / "scenario.toml", tmp_path)
    with pytest.raises(RunError, match="holds no record"):
        replayed(tmp_path, log)
    pq.write_table(pa.table({"time": [0.0, 0.1]}), tmp_path / "record.parquet")
    with pytest.raises(RunError, match=r"no columns 'position\.x'"):
        replayed(tmp_path, log)
    assert not log.exists()
