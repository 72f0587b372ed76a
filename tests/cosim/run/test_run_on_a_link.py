"""A run as a MAVLink vehicle: telemetry does not change the record, and commands replay it."""

import socket
import threading
import time

import numpy as np
import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import all as mavlink

from cosim.errors import RunError, TelemetryError
from cosim.mavlink.run_links import Mavlink
from cosim.mavlink.wire.endpoint import parse_endpoint
from cosim.mavlink.wire.options import MavlinkOptions
from cosim.results.record import load_record
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario

SHORT = ["time.duration=3"]


class Station:
    """A ground station that sends its messages in sequence once it receives the vehicle."""

    def __init__(self, *messages):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(0.05)
        self.endpoint = f"udpout:127.0.0.1:{self.socket.getsockname()[1]}"
        self.queue, self.received, self.done = list(messages), [], threading.Event()
        self.codec = mavlink.MAVLink(None, 255, 190)
        self.thread = threading.Thread(target=self.live)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.done.set()
        self.thread.join()
        self.socket.close()

    def live(self):
        parser, last = mavlink.MAVLink(None), 0.0
        while True:
            ends = self.done.is_set()
            try:
                data, vehicle = self.socket.recvfrom(2048)
            except TimeoutError:
                if ends:  # and all that had come is read
                    return
                continue
            self.received += parser.parse_buffer(data) or []
            if self.queue and time.monotonic() - last > 0.1:
                last = time.monotonic()
                self.socket.sendto(self.queue.pop(0).pack(self.codec), vehicle)

    def of(self, name):
        return [m for m in self.received if m.get_type() == name]


def logged(path, name):
    """Return the messages of a kind in a log."""
    log, messages = mavutil.mavlink_connection(str(path)), []
    while (message := log.recv_match(type=name)) is not None:
        messages.append(message)
    log.close()
    return messages


def command(number, *numbers):
    return mavlink.MAVLink_command_long_message(1, 1, number, 0, *numbers, *[0.0] * (7 - len(numbers)))


def on(station, *more, **options):
    endpoints = [parse_endpoint(text) for text in (station.endpoint, *more)]
    return Mavlink(tuple(endpoints), MavlinkOptions(**options))


def same(a, b):
    return list(a.units) == list(b.units) and all(np.array_equal(a[name], b[name]) for name in a.units)


@pytest.fixture(autouse=True)
def patient_links(monkeypatch):
    """Give links time to send all that is queued, however busy the machine."""
    for limit in ("_DRAINING", "_CLOSING"):
        monkeypatch.setattr(f"cosim.mavlink.thread.{limit}", 120.0)


@pytest.mark.medium
def test_telemetry_does_not_change_the_record(tmp_path):
    scenario = load_scenario("harbour", SHORT)
    alone = run_scenario(scenario, tmp_path / "alone", report=False)
    with Station(command(400, 0.0), command(512, 148.0)) as station:
        log = tmp_path / "run.tlog"
        linked = run_scenario(scenario, tmp_path / "linked", on(station, str(log)), report=False)
    assert same(load_record(alone.folder), load_record(linked.folder))
    assert {m.autopilot for m in station.of("HEARTBEAT")} == {mavlink.MAV_AUTOPILOT_GENERIC}
    positions = logged(log, "LOCAL_POSITION_NED")
    assert [m.time_boot_ms for m in positions] == list(range(0, 3001, 100))
    record = load_record(linked.folder)
    assert [m.x for m in positions] == pytest.approx(record["position.x"][::10].tolist(), abs=1e-6)
    # datagrams may be lost on the way to a station that does not look, but none comes twice or in another order
    places = {m.time_boot_ms: m.x for m in positions}
    there = station.of("LOCAL_POSITION_NED")
    assert [m.time_boot_ms for m in there] == sorted({m.time_boot_ms for m in there} & places.keys())
    assert there and all(m.x == places[m.time_boot_ms] for m in there)


@pytest.mark.slow
def test_commands_received_over_mavlink_replay_bit_for_bit(tmp_path):
    scenario = load_scenario("harbour", ["time.duration=2", "commands.enabled=true", "commands.await_arm=true"])
    target = mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 0b110111111000, 2, -1, 2, *[0] * 8)
    messages = [command(400, 1.0), target, command(192, -1.0, 1.0, 0.0, 0.7), command(176, 1.0, 4.0, 3.0)]
    with Station(*messages) as station:
        live = run_scenario(
            scenario, tmp_path / "live", on(station, commands=True, origin=(0.0, 0.0)), rate=1.0, report=False
        )
    acks = {m.command: m.result for m in station.of("COMMAND_ACK")}
    assert acks == {400: 0, 192: 0, 176: 0}
    assert live.summary["commands"] >= 4
    again = run_scenario(
        load_scenario(live.folder / "scenario.toml"), tmp_path / "again", report=False,
        commands_log=live.folder / "commands.jsonl",
    )  # fmt: skip
    assert same(load_record(live.folder), load_record(again.folder))
    modes = load_record(live.folder)["commands.mode"]
    assert modes[0] == 2.0 and modes[-1] == 1.0  # reach, then hold


@pytest.mark.slow
def test_restart_starts_a_new_run_on_the_same_link(tmp_path):
    scenario = load_scenario("harbour", ["time.duration=1.5", "commands.enabled=true"])
    messages = [command(512, 1.0)] * 4  # some tenths of a second
    with Station(*messages, command(246, 1.0, 0.0, 0.0, 0.0, 0.0, 20190226.0)) as station:
        last = run_scenario(scenario, tmp_path / "run", on(station, commands=True), rate=1.0, report=False)
    assert last.folder == tmp_path / "run-2"
    assert last.summary["status"] == "completed"
    first = load_record(tmp_path / "run")
    assert 0 < len(first["time"]) < scenario.steps
    boots = [m.time_boot_ms for m in station.of("LOCAL_POSITION_NED")]
    assert sum(b < a for a, b in zip(boots, boots[1:], strict=False)) == 1
    assert 1400 <= boots[-1] <= 1500
    # the log of the first run repeats it alone
    again = run_scenario(
        load_scenario(tmp_path / "run" / "scenario.toml"), tmp_path / "again", report=False,
        commands_log=tmp_path / "run" / "commands.jsonl",
    )  # fmt: skip
    assert again.summary["status"] == "reset"
    assert same(first, load_record(again.folder))


def test_commands_log_requires_commands_enabled(tmp_path):
    (tmp_path / "commands.jsonl").touch()
    with pytest.raises(RunError, match=r"expected a scenario with commands\.enabled"):
        run_scenario(load_scenario("paper", SHORT), tmp_path / "run", commands_log=tmp_path / "commands.jsonl")
    assert not (tmp_path / "run").exists()


def test_a_link_that_cannot_be_opened_leaves_no_folder(tmp_path):
    taken = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    taken.bind(("127.0.0.1", 0))
    endpoint = parse_endpoint(f"udpin:127.0.0.1:{taken.getsockname()[1]}")
    with taken, pytest.raises(TelemetryError, match="in use"):
        run_scenario(load_scenario("paper", SHORT), tmp_path / "run", Mavlink((endpoint,), MavlinkOptions()))
    assert not (tmp_path / "run").exists()


def test_failed_start_leaves_no_log(tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "notes").touch()
    log = tmp_path / "run.tlog"
    with pytest.raises(RunError, match="not empty"):
        run_scenario(
            load_scenario("paper", SHORT), tmp_path / "run",
            Mavlink((parse_endpoint(str(log)),), MavlinkOptions()),
        )  # fmt: skip
    assert not log.exists()
