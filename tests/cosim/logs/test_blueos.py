"""Recordings of BlueOS: a real telemetry log, each message as JSON the way mavlink-server writes it."""

import json
import math
import struct

import numpy as np
import pytest
from pymavlink import mavutil

import cosim
from cosim.results.log_facts import load_log_facts
from tests.cosim.logs.conftest import LOGS, facts_by_quantity, has_remark

mcap = pytest.importorskip("mcap.writer")
INFINITE = b"""{"header": {"component_id": 1, "system_id": Infinity},
"message": {"autopilot": 3, "mavtype": 12}, "HEARTBEAT": 1}"""
FLAGS = {"HEARTBEAT": {"base_mode"}}


def value_of(dialect, message, name, style):
    """Return a field as rust-mavlink serializes it: enumerations by name, flags by bits or names, no NaN."""
    value, enumeration = getattr(message, name), message.fieldenums_by_name.get(name)
    if isinstance(value, (bytes, str)):
        text = value.decode() if isinstance(value, bytes) else value
        return text if style == "names" else [*text.ljust(16, "\0")]
    if name in FLAGS.get(message.get_type(), ()):
        if style == "bits":
            return {"bits": value}
        flags = dialect.enums[enumeration]
        return " | ".join(flags[1 << i].name for i in range(8) if value & (1 << i))
    if enumeration and value in dialect.enums[enumeration]:
        return {"type": dialect.enums[enumeration][value].name}
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write_recording(path, seconds, style="names", topics=("out", "each", "fields")):
    """Write what the recorder of BlueOS writes, of the first seconds of a telemetry log, and these as telemetry."""
    log = mavutil.mavlink_connection(str(LOGS / "small.tlog"), dialect="ardupilotmega")
    dialect = mavutil.mavlink
    with path.open("wb") as file, path.with_suffix(".tlog").open("wb") as telemetry:
        writer = mcap.Writer(file, chunk_size=1 << 16)
        writer.start(profile="", library="stand-in")
        channels: dict[str, int] = {}

        def put(topic, data, time):
            if topic not in channels:
                channels[topic] = writer.register_channel(topic=topic, message_encoding="json", schema_id=0)
            writer.add_message(channels[topic], log_time=time, publish_time=time, data=json.dumps(data).encode())

        first = None
        while (message := log.recv_match()) is not None and message._timestamp < (first or math.inf) + seconds:
            name = message.get_type()
            if name == "BAD_DATA" or name.startswith("UNKNOWN"):
                continue
            first = first or message._timestamp
            fields = {
                {"type": "mavtype"}.get(field, field): value_of(dialect, message, field, style)
                for field in message.get_fieldnames()
            }
            telemetry.write(struct.pack(">Q", round(message._timestamp * 1e6)) + message.get_msgbuf())
            sender = (message.get_srcSystem(), message.get_srcComponent())
            header = {"system_id": sender[0], "component_id": sender[1], "sequence": message.get_seq()}
            whole, time = {"header": header, "message": {"type": name} | fields}, round(message._timestamp * 1e9)
            if "out" in topics:
                put("mavlink/out", whole, time)
            if "each" in topics:
                put(f"mavlink/{sender[0]}/{sender[1]}/{name}", whole, time)
            if "fields" in topics and name == "ATTITUDE":
                put(f"mavlink/{sender[0]}/{sender[1]}/{name}/roll", fields["roll"], time)
        put("services/autopilot/log", {"line": "no MAVLink"}, time)
        writer.finish()
    log.close()


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize(
    ("style", "topics"), [("names", ("out", "each", "fields")), ("bits", ("out",)), ("names", ("each",))]
)
def test_recording_is_the_run_of_its_telemetry(style, topics, tmp_path):
    write_recording(tmp_path / "dive.mcap", 20.0, style, topics)
    run, expected = (
        cosim.import_log(tmp_path / f"dive.{form}", "bluerov2_heavy", tmp_path / form, report=False)
        for form in ("mcap", "tlog")
    )
    assert run.summary["law"] == "ardupilot" and run.summary["simulated_time"] > 19.0
    assert run.record.units == expected.record.units and len(run.record) == len(expected.record)
    for name in run.record.units:
        np.testing.assert_allclose(run.record[name], expected.record[name], rtol=1e-6, atol=1e-6, err_msg=name)
    unread = load_log_facts(run.folder).unread
    assert unread["services/autopilot/log"] == 1 and not any("not as expected" in name for name in unread)


@pytest.mark.medium
def test_recordings_of_a_dive_are_one_run(tmp_path, imported):
    """BlueOS begins a new file when the vehicle is armed."""
    folder = tmp_path / "dive"
    folder.mkdir()
    for name in ("recorder_20260816_093739", "recorder_20260816_203739"):
        write_recording(folder / f"{name}.mcap", 10.0, topics=("each",))
    assert has_remark(imported(folder), "The clock of the recorder jumps")


@pytest.mark.medium
def test_a_damaged_chunk_is_a_gap(tmp_path, imported):
    path = tmp_path / "dive.mcap"
    write_recording(path, 20.0, topics=("each",))
    before = facts_by_quantity(imported(path))["attitude"].gaps
    data = bytearray(path.read_bytes())
    data[len(data) // 2 : len(data) // 2 + 8] = bytes(8)
    path.write_bytes(data)
    run = imported(path)
    assert has_remark(run, "bytes of dive.mcap are damaged and were passed over.")
    assert facts_by_quantity(run)["attitude"].gaps == before + 1


@pytest.mark.parametrize(
    ("messages", "what"),
    [
        ([], "holds no message, expected a bag with messages"),
        ([("services/x/log", b"{}")], "needs a column map"),
        ([("mavlink/out", b"{}")], "holds no heartbeat of an autopilot, expected a recording of a vehicle"),
        ([("mavlink/1/1/HEARTBEAT", b'{"HEARTBEAT": ')], "holds no heartbeat of an autopilot"),
        ([("mavlink/1/1/HEARTBEAT", INFINITE)], "holds no heartbeat of an autopilot"),
        ([("mavlink/1/1/HEARTBEAT", b'{"header": "HEARTBEAT", "message": ' + b"[" * 2**21)], "holds no heartbeat"),
    ],
)
def test_recording_without_a_vehicle_is_refused(messages, what, tmp_path, refused):
    with (tmp_path / "it.mcap").open("wb") as file:
        writer = mcap.Writer(file)
        writer.start()
        for topic, data in messages:
            channel = writer.register_channel(topic=topic, message_encoding="json", schema_id=0)
            writer.add_message(channel, log_time=1, publish_time=1, data=data)
        writer.finish()
    refused(what, tmp_path / "it.mcap")
