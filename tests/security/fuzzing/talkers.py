"""Every reader of data from a connection or from the command line."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import all as mavlink
from rich.console import Console

from controller.laws import LAWS
from cosim.campaigns.scenes.law_gains import gains_from
from cosim.campaigns.sweeps.design import vary_from
from cosim.live.address import foreign_origin, parse_live
from cosim.live.command_desk import MAX_LENGTH, CommandDesk
from cosim.live.viewer_messages import format_message, write_rows
from cosim.live.watching import snapshot_table, snapshots
from cosim.mavlink.listening import TelemetryTable
from cosim.mavlink.listening import format_table as table
from cosim.mavlink.wire.endpoint import parse_endpoint
from cosim.mavlink.wire.framing import FrameFilter, RxStats, StreamReader
from cosim.mavlink.wire.ground_end import ReceivedMessage
from cosim.replay.header import header_of
from cosim.replay.view_columns import ViewColumns
from cosim.scenario.scenario import load_scenario
from cosim.simulation.commands.sources import CommandQueue
from cosim.sitl import json_protocol
from cosim.sitl.hil_server import HilServer
from cosim.sitl.law import make_control_law, make_pwm_law
from cosim.sitl.sitl_session import FrameCounts as HilCounts
from fuzzy_arbiter.rule import parse_rule
from plant_fmu import load_vehicle
from tests.cosim.mavlink.station import Station
from tests.security.conftest import COMMANDS_LOG
from tests.security.fuzzing.registry import Case, Seeds, reader

# ---- the live page -------------------------------------------------------------------------------------------------


@reader("command of a viewer", "json", "cosim.live.command_desk:CommandDesk.submit")
def command(seeds: Seeds) -> Case:
    scenario = load_scenario("paper", ["commands.enabled=true", "commands.obstacles=2"])
    queue = CommandQueue()
    desk = CommandDesk(scenario, queue, lambda name: True)

    def read(content: bytes) -> None:
        try:
            message = content[:MAX_LENGTH].decode()
        except UnicodeDecodeError:  # by which WebSocket has a connection fail
            return
        queue.take(0)
        said = desk.submit(message)
        assert said is None or (said.isprintable() and 0 < len(said) < 300), said

    return Case(tuple(json.dumps(command).encode() for command in COMMANDS_LOG), read)


@reader("live view", "jsonl", "cosim.live.watching.run_views:_follow_live", "cosim.live.viewer_messages:read_rows")
def live_view(seeds: Seeds) -> Case:
    scenario = load_scenario("paper", ["commands.enabled=true", "commands.obstacles=2"])
    columns = load_columns(seeds)
    viewing = ViewColumns(scenario, columns)
    header = header_of(scenario, viewing.columns, commands=True)
    rows = write_rows(np.zeros((2, len(viewing.columns))))
    texts = [
        format_message("header", run=header),
        format_message("said", kind="info", text="a word", time=None),
        format_message("end", status="completed", verdict="It came to its end."),
    ]
    console = Console(width=100, quiet=True)

    def read(content: bytes) -> None:
        messages: list[str | bytes] = [line.decode("utf-8", "replace") for line in content.splitlines()]
        messages[1:1] = [rows]
        seeds.patch.setattr("socket.create_connection", lambda *_, **__: None)
        seeds.patch.setattr("websockets.sync.client.connect", lambda *_, **__: contextlib.nullcontext(messages))
        for look in snapshots("ws://127.0.0.1:8765"):
            console.print(snapshot_table(look))

    return Case(("\n".join(texts).encode() + b"\n",), read, "ws://127.0.0.1:8765")


def load_columns(seeds: Seeds) -> Any:
    from cosim.results.record import load_record

    return load_record(seeds.run).columns


# ---- MAVLink and simulators ----------------------------------------------------------------------------------------

_SENDER = (250, 190)


def _frames() -> bytes:
    codec = mavlink.MAVLink(None, *_SENDER)
    m = mavlink
    messages = [
        m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3),
        m.MAVLink_command_long_message(1, 1, m.MAV_CMD_COMPONENT_ARM_DISARM, 0, 1, 0, 0, 0, 0, 0, 0),
        m.MAVLink_mission_count_message(1, 1, 2, 0),
        m.MAVLink_mission_item_int_message(1, 1, 0, 6, 16, 0, 1, 0, 0, 0, 0, 559000000, -33000000, -4, 0),
        m.MAVLink_mission_item_int_message(1, 1, 1, 1, 17, 0, 1, 5, 0, 0, 0, 7, 0, -4, 0),
        m.MAVLink_mission_request_list_message(1, 1, 0),
        m.MAVLink_param_request_list_message(1, 1),
        m.MAVLink_param_set_message(1, 1, b"MAV_SYS_ID", 3.0, 9),
        m.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 0xDF8, 7, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0),
        m.MAVLink_manual_control_message(1, 100, 0, 500, 0, 0),
        m.MAVLink_obstacle_distance_message(0, 0, [100] * 72, 5, 10, 900, 5.0, 0.0, 12),
        m.MAVLink_file_transfer_protocol_message(0, 1, 1, bytes([0, 0, 0, 4, 12]) + b"\0" * 246),
        m.MAVLink_statustext_message(6, b"a word"),
    ]
    return b"".join(message.pack(codec) for message in messages)


_FRAMING = ("cosim.mavlink.wire.framing:FrameFilter._decode", "cosim.mavlink.wire.framing:parse_header")


@reader(
    "MAVLink frames, to a vehicle",
    "bytes",
    *_FRAMING,
    "cosim.mavlink.services.ftp:FileServer._receive_file_transfer_protocol",
)
def to_vehicle(seeds: Seeds) -> Case:
    station = Station()
    station.look()

    def read(content: bytes) -> None:
        for _, message in StreamReader(FrameFilter(RxStats(), (1, 1))).read(content):
            station.autopilot.receive(station.wire, message, station.now)
        station.wait(0.04)
        station.commanded()
        station.wire.clear()

    return Case((_frames(),), read)


@reader("MAVLink frames, to a ground station", "bytes", *_FRAMING)
def to_ground(seeds: Seeds) -> Case:
    class Link:
        name = "udpin:127.0.0.1:14550"

        def loss_reports(self) -> list[str]:
            return []

    def read(content: bytes) -> None:
        watch = TelemetryTable()
        for _, m in FrameFilter(RxStats()).read_datagram(content):
            watch.add(ReceivedMessage(1.0, m.get_srcSystem(), m.get_srcComponent(), m.get_seq(), m.get_type(), m))
        watch.sample(2.0)
        assert all(line.isprintable() for line in table(Link(), watch, 2.0))  # type: ignore[arg-type]

    return Case((_frames(),), read)


@reader("MAVLink frames, to a simulator", "bytes", "cosim.sitl.hil_server:HilServer._controls")
def to_simulator(seeds: Seeds) -> Case:
    server: Any = HilServer.__new__(HilServer)
    server.counts, server._mavlink = HilCounts(), mavlink
    law = make_control_law(load_vehicle("bluerov2_heavy"))
    codec = mavlink.MAVLink(None, 1, 1)
    frames = b"".join(
        mavlink.MAVLink_hil_actuator_controls_message(1, [0.1] * 16, 128, 0).pack(codec) for _ in range(3)
    )

    def read(content: bytes) -> None:
        codec.robust_parsing = True
        for _, outputs in server._controls(codec, content):
            law.set_outputs(outputs)

    return Case((frames,), read)


@reader("servo packet", "bytes", "cosim.sitl.json_protocol:parse_packet")
def servos(seeds: Seeds) -> Case:
    law = make_pwm_law(load_vehicle("bluerov2_heavy"))

    def read(content: bytes) -> None:
        packet = json_protocol.parse_packet(content)
        if packet is not None:
            law.set_outputs(packet.pwm)

    packets = [
        json_protocol._PACKINGS[magic].pack(magic, 400, 7, *[1500] * n) for magic, n in ((18458, 16), (29569, 32))
    ]
    return Case(tuple(packets), read)


# ---- the command line ----------------------------------------------------------------------------------------------


def _resolve_host(host: str) -> tuple[str, bool]:
    if host == "127.0.0.1":
        return host, True
    raise OSError("not asked")


def _origin(text: str) -> None:
    host, _, site = text.partition(" ")
    said = foreign_origin(parse_live(""), host, site or None)
    assert said is None or "\n" not in said


def _argument(read: Callable[[str], object], sound: tuple[str, ...], seeds: Seeds) -> Case:
    """Return the case of a word, which is any bytes without a null among them."""
    for module in ("cosim.mavlink.wire.endpoint", "cosim.live.address"):
        seeds.patch.setattr(f"{module}.resolve_host", _resolve_host)

    def taken(content: bytes) -> object:
        return read(content.replace(b"\0", b"").decode("utf-8", "surrogateescape"))

    return Case(tuple(text.encode() for text in sound), taken)


_CHANGES = (
    "law.gains.k_p1=10", "regions.SR1.shape.radius=2", "initial.position.0=1", "title='a'", "time={duration=2}",
)  # fmt: skip
_ENDPOINTS = "udpout:127.0.0.1:14550", "tcpin:127.0.0.1:5760", "serial:/dev/ttyUSB0:57600", "dive.tlog"
_RULE = ('if a is b and (not "c d" is e or f is very_g) then h is i with 0.5',)
WORDS: list[tuple[str, str, Callable[[str], object], tuple[str, ...]]] = [
    ("change of a scenario", "scenario.toml_file:override", lambda text: load_scenario("paper", [text]), _CHANGES),
    ("what varies", "campaigns.sweeps.design:_parse_vary", lambda text: vary_from([text]),
     ("limit.force=50:500:4:log", "a.b=-1:1", "c=1,2.5,1e3")),
    ("gain", "campaigns.scenes.law_gains:gains_from", lambda text: LAWS["pd"].validate(gains_from("pd", [text])),
     ("k_p1=10", "k_v1 = 1.5e2")),
    ("endpoint", "mavlink.wire.endpoint:parse_endpoint", parse_endpoint, _ENDPOINTS),
    ("live address", "live.address:parse_live", parse_live, ("127.0.0.1:8765", "8765")),
    ("host and origin", "live.address:foreign_origin", _origin,
     ("127.0.0.1:8765 http://127.0.0.1:8765", "localhost:8765")),
]  # fmt: skip
for _name, _parser, _read, _sound in WORDS:
    reader(_name, "text", f"cosim.{_parser}")(partial(_argument, _read, _sound))
reader("rule", "text", "fuzzy_arbiter.rule:parse_rule")(partial(_argument, parse_rule, _RULE))
