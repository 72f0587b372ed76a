"""The client side of the conformance checks against a scripted vehicle that loses messages."""

import json
import math
import time
from collections import deque
from types import SimpleNamespace

import pytest
from pymavlink.dialects.v20 import all as mavlink

from cosim.command_line.cli import main
from cosim.mavlink.conformance import (
    CHECKS,
    Client,
    Result,
    as_json,
    as_text,
    connect,
    fetch_mission,
    fetch_parameters,
    ftp,
    qgc_connect,
    summary,
)
from cosim.mavlink.conformance.baselines import baseline_of
from cosim.mavlink.conformance.outcome import Check, Subject, failed, judged, passed, skipped, speed_of
from cosim.mavlink.wire.ground_end import Heard

QUICK = {
    connect: {"_LIST_TIMEOUT": 0.05, "_GAP_TIMEOUT": 0.02, "_MISSION_TIMEOUT": 0.02, "_ACK_TIMEOUT": 0.02,
              "_MESSAGE_TIMEOUT": 0.02, "_HEARTBEAT_TIMEOUT": 0.1},
    ftp: {"_TIMEOUT": 0.02},
}  # fmt: skip


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    for module, constants in QUICK.items():
        for name, seconds in constants.items():
            monkeypatch.setattr(module, name, seconds)


class Scripted:
    """A link whose other side is a function: from a message to the list of its answers."""

    name, identity, old = "scripted", (255, 190), 0

    def __init__(self, answer, beat=True):
        self.answer, self.sent, self.waiting, self.sequence = answer, [], deque(), 0
        if beat:
            self.come(mavlink.MAVLink_heartbeat_message(12, 12, 1, 0, 4, 3))

    def come(self, message, component=1):
        codec = mavlink.MAVLink(None, 1, component)
        codec.seq, self.sequence = self.sequence, (self.sequence + 1) % 256
        decoded = mavlink.MAVLink(None).decode(bytearray(message.pack(codec)))
        sender = 1, component, decoded.get_seq(), decoded.get_type()
        self.waiting.append(Heard(time.monotonic(), *sender, decoded))

    def receive(self, timeout):
        if not self.waiting:
            time.sleep(min(timeout, 0.002))
        found = list(self.waiting)
        self.waiting.clear()
        return found

    def send(self, message):
        self.sent.append(message)
        for reply in self.answer(message) or ():
            self.come(reply)
        return True

    def beat(self):
        pass


def client_of(answer):
    client = Client(Scripted(answer))
    assert client.find(0.1) is not None
    client.discard_unread()
    return client


def parameter(index, count):
    return mavlink.MAVLink_param_value_message(f"P{index}".encode(), float(index), 9, count, index)


def test_other_components_and_stations_are_not_the_vehicle():
    link = Scripted(lambda message: None, beat=False)
    link.come(mavlink.MAVLink_heartbeat_message(12, 12, 1, 0, 4, 3), component=100)
    link.come(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    client = Client(link)
    assert client.find(0.02) is None
    link.come(mavlink.MAVLink_heartbeat_message(12, 3, 1, 0, 4, 3))
    assert client.find(0.1) == (1, 1, 3, 12)


def test_missing_sequence_numbers_are_counted():
    client = client_of(lambda message: None)
    for _ in range(3):
        client.link.come(mavlink.MAVLink_ping_message(0, 0, 0, 0))
    client.link.sequence += 5
    client.link.come(mavlink.MAVLink_ping_message(0, 0, 0, 0))
    client.pump()
    assert client.lost == 5 and client.total == 5


def test_answer_among_other_messages_is_found():
    def answer(message):
        if message.get_type() == "COMMAND_LONG":
            ack = mavlink.MAVLink_command_ack_message(message.command, 0)
            return [ack, mavlink.MAVLink_ping_message(0, 7, 0, 0)]
        return None

    client = client_of(answer)
    assert client.command(400).result == 0
    assert client.wait(lambda m: m.get_type() == "PING", 0.1).seq == 7
    assert client.wait(lambda m: m.get_type() == "PING", 0.01) is None
    assert all(math.isnan(client.link.sent[-1].to_dict()[f"param{i}"]) for i in range(1, 8))


def test_lost_parameters_are_requested_again():
    lost = {2, 5}

    def answer(message):
        if message.get_type() == "PARAM_REQUEST_LIST":
            return [parameter(i, 8) for i in range(8) if i not in lost]
        if message.get_type() == "PARAM_REQUEST_READ":
            return [parameter(message.param_index, 8)]
        return None

    values, count, retries = fetch_parameters(client_of(answer))
    assert sorted(values) == list(range(8)) and count == 8 and retries == 1


def test_vehicle_without_parameters_times_out():
    assert fetch_parameters(client_of(lambda message: None)) == ({}, None, 5)


def test_lost_mission_item_is_requested_again():
    asked = []

    def answer(message):
        if message.get_type() == "MISSION_REQUEST_LIST":
            return [mavlink.MAVLink_mission_count_message(255, 190, 2, message.mission_type)]
        if message.get_type() == "MISSION_REQUEST_INT":
            asked.append(message.seq)
            if asked == [0, 1]:
                return None
            return [mavlink.MAVLink_mission_item_int_message(255, 190, message.seq, 6, 16, 0, 1, 0, 0, 0, 0, 1, 2, 3.0)]
        return None

    client = client_of(answer)
    items, said, retries = fetch_mission(client, 0)
    assert [item.seq for item in items] == [0, 1] and asked == [0, 1, 1]
    assert said == "2 items" and retries == 1
    assert client.link.sent[-1].get_type() == "MISSION_ACK"


class FileServer:
    """A file by MAV-FTP; the bursts leave out the packets with these numbers."""

    def __init__(self, data, lost=()):
        self.data, self.lost = data, lost

    def reply(self, request, opcode, data=b"", offset=0, complete=False):
        head = ftp._HEADER.pack(request.sequence + 1 & 0xFFFF, 3, opcode, len(data), request.opcode, complete, offset)
        payload = list((head + data).ljust(251, b"\0"))
        return mavlink.MAVLink_file_transfer_protocol_message(0, 255, 190, payload)

    def __call__(self, message):
        if message.get_type() != "FILE_TRANSFER_PROTOCOL":
            return None
        request = ftp._packet(message)
        if request.opcode == ftp._OPEN:
            if request.data != b"@PARAM/param.pck":
                return [self.reply(request, ftp._NAK, bytes([10]))]
            return [self.reply(request, ftp._ACK, len(self.data).to_bytes(4, "little"))]
        if request.opcode == ftp._BURST:
            starts = range(request.offset, len(self.data), 239)
            return [
                self.reply(request, ftp._ACK, self.data[at : at + 239], at, at == starts[-1])
                for i, at in enumerate(starts) if i not in self.lost
            ]  # fmt: skip
        if request.opcode == ftp._READ:
            at = request.offset
            return [self.reply(request, ftp._ACK, self.data[at : at + 239], at)]
        return [self.reply(request, ftp._ACK)]


@pytest.mark.parametrize("lost", [(), (1,), (0, 2)])
def test_ftp_download_survives_lost_burst_packets(lost):
    data = bytes(range(256)) * 5
    found = ftp.download(client_of(FileServer(data, lost)), "@PARAM/param.pck")
    assert found.data == data and found.retries == 0


def test_ftp_file_shorter_than_announced_is_read_completely():
    """As ArduPilot's of parameters, of which it announces twelve bytes each: the end is what it refuses to read."""

    class Estimating(FileServer):
        def __call__(self, message):
            replies = super().__call__(message)
            request = ftp._packet(message)
            if request.opcode == ftp._OPEN:
                return [self.reply(request, ftp._ACK, (len(self.data) + 500).to_bytes(4, "little"))]
            if request.opcode in (ftp._READ, ftp._BURST) and request.offset >= len(self.data):
                return [self.reply(request, ftp._NAK, bytes([ftp._END_OF_FILE]))]
            return replies

    data = bytes(range(256)) * 5
    for lost in ((), (2,)):
        assert ftp.download(client_of(Estimating(data, lost)), "@PARAM/param.pck").data == data


def ardupilot(custom=b"d3adbeef"):
    """Return a client that has found an ArduSub with a custom version."""

    def answer(message):
        if message.get_type() != "COMMAND_LONG" or message.param1 != mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION:
            return None
        return [mavlink.MAVLink_autopilot_version_message(0x2004, *[0] * 4, list(custom), *[[0] * 8] * 2, 0, 0, 0)]

    link = Scripted(answer, beat=False)
    link.come(mavlink.MAVLink_heartbeat_message(12, 3, 81, 19, 4, 3))
    client = Client(link)
    client.find(1.0)
    return client


def test_only_known_differences_of_ardusub_are_tolerated():
    baseline = baseline_of(Subject(ardupilot(), (), 1.0, False))
    assert set(baseline.differences) <= {check.name for check in CHECKS}
    known = baseline.apply("parameter-unknown", failed("nothing", "an answer"))
    assert known.status == "differs" and known.expected.startswith("an answer; ArduSub: it is silent")
    assert baseline.apply("parameter-unknown", passed("fine")).status == "pass"
    assert baseline.apply("one-ack", failed("two", "one")).status == "fail"
    result = Result(CHECKS[0], known, 0.1)
    assert as_text(result).startswith("DIFFERS heartbeat-identity")
    assert summary([result]) == "0 passed, 0 failed, 1 differ as known, 0 skipped, 0.1 s"
    assert json.loads(as_json("x", [result]))["passed"] is True


def test_own_vehicle_and_other_autopilots_have_no_tolerated_differences():
    ours = baseline_of(Subject(ardupilot(b"subreach"), (), 1.0, False))
    px4 = baseline_of(Subject(client_of(lambda message: None), (), 1.0, False))
    assert not ours.differences and not px4.differences


def test_missing_ftp_file_is_reported():
    assert ftp.download(client_of(FileServer(b"x")), "other") == (None, "FileNotFound", 0)
    assert ftp.download(client_of(lambda message: None), "other") == (None, "no answer", 3)


def test_connection_counts_retries_and_names_missing_steps():
    ignored = []

    def answer(message):
        if message.get_type() == "COMMAND_LONG":
            if not ignored:
                ignored.append(message)
                return None
            known = message.param1 == mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION
            ack = mavlink.MAVLink_command_ack_message(message.command, 0 if known else 4)
            return [ack, mavlink.MAVLink_autopilot_version_message(0x2004, *[0] * 4, *[[0] * 8] * 3, 0, 0, 0)][
                : 1 + known
            ]
        if message.get_type() == "MISSION_REQUEST_LIST":
            return [mavlink.MAVLink_mission_count_message(255, 190, 0, message.mission_type)]
        return None

    connection = qgc_connect(Client(Scripted(answer)))
    steps = {step.name: step for step in connection.steps}
    assert list(steps) == ["version", "modes", "metadata", "streams", "parameters", "mission"]
    assert steps["version"].retries == 1 and steps["mission"].good
    assert not steps["parameters"].good and not connection.good
    assert connection.retries == 1 + steps["parameters"].retries
    assert qgc_connect(Client(Scripted(answer, beat=False))).steps == ()


def test_clock_speed_is_derived_from_boot_times():
    heard = tuple(Heard(0.5 * i, 1, 1, 0, "ATTITUDE", SimpleNamespace(time_boot_ms=4000 * i)) for i in range(5))
    assert speed_of(heard) == pytest.approx(8.0)
    assert speed_of(heard[:1]) == 1.0 == speed_of(())


def test_results_are_printed_as_text_and_json():
    check = Check("some-check", ("QGC", "MAVSDK"), lambda subject: passed(""))
    results = [
        Result(check, passed("fine"), 0.1),
        Result(check, failed("\x1b[2Jbad", "good"), 0.2),
        Result(check, skipped("why"), 0.3),
    ]
    assert as_text(results[1]) == "FAIL some-check             ?[2Jbad; expected good [QGC, MAVSDK]"
    assert summary(results) == "1 passed, 1 failed, 1 skipped, 0.6 s"
    document = json.loads(as_json("udpin:here", results))
    assert document["endpoint"] == "udpin:here" and document["passed"] is False
    assert document["checks"][1] == {
        "name": "some-check", "clients": ["QGC", "MAVSDK"], "status": "fail", "received": "?[2Jbad", "expected": "good",
        "seconds": 0.2,
    }  # fmt: skip
    assert judged(True, "a", "b") == passed("a") and judged(False, "a", "b") == failed("a", "b")


def test_profile_and_endpoint_are_mutually_exclusive(capsys):
    assert main(["mavlink-check", "udpin:127.0.0.1:14999", "--profile", "px4"]) == 2
    assert "--profile" in capsys.readouterr().err
