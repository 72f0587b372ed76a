"""``cosim mavlink listen``: known vehicles, their display, bounded memory, and terminal safety."""

import math
import os
import pty
import re
import select
import signal
import subprocess
import sys

import pytest
from pymavlink.dialects.v20 import all as mavlink

from cosim.command_line.cli import main
from cosim.mavlink.listening import TelemetryTable, follow, format_table
from cosim.mavlink.listening.fields import format_values
from cosim.mavlink.listening.table_text import mode_name
from cosim.mavlink.listening.telemetry_table import MAX_ROWS, MAX_TEXTS
from cosim.mavlink.wire.endpoint import parse_endpoint
from cosim.mavlink.wire.ground_end import GroundLink, ReceivedMessage
from tests.cosim.mavlink import stubs
from tests.cosim.mavlink.stubs import HERE, Codec, free_port, message, udp_socket

ESCAPE = b"\x1b[31mred\x07"


def heartbeat(**values):
    defaults = {"autopilot": 12, "base_mode": 0x81, "custom_mode": 6 << 16}
    return stubs.heartbeat(**defaults | values)


def received(sent, at=0.0, system=1, component=1):
    return ReceivedMessage(at, system, component, 0, sent.get_type(), sent)


@pytest.fixture
def link():
    with GroundLink(parse_endpoint(f"udpin:{HERE}:{free_port()}")) as link:
        yield link


@pytest.fixture
def shown(link):
    """Return a function that gives the lines of a table of some messages, and the table."""

    def shown(*messages, now=1.0, **size):
        table = TelemetryTable()
        for sent in messages:
            table.add(sent if isinstance(sent, ReceivedMessage) else received(sent, 1.0))
        return format_table(link, table, now, **size), table

    return shown


def vehicle(port):
    """Return a function that sends messages to a port, with pymavlink's encoder alone."""
    codec, sender = Codec(1, 1), udp_socket()
    return lambda message, v1=False: sender.sendto(codec.pack(message, v1), (HERE, port))


def test_display_shows_vehicle_position_texts_and_messages(shown):
    attitudes = [received(message("ATTITUDE", roll=0.1, pitch=-0.2, yaw=0.3), 0.1 * i) for i in range(11)]
    lines, _ = shown(
        *attitudes, heartbeat(), message("LOCAL_POSITION_NED", x=1.5, y=-2.25, z=3.0),
        message("GLOBAL_POSITION_INT", relative_alt=-3000),
        message("STATUSTEXT", severity=4, text=b"region SR1 entered"),
    )  # fmt: skip
    text = "\n".join(lines)
    assert "vehicle 1:1 PX4 SUBMARINE, mode OFFBOARD, ARMED, ACTIVE" in text
    assert "north 1.50 east -2.25 down 3.00 m, roll 5.7 pitch -11.5 yaw 17.2 deg, depth 3.00 m" in text
    assert "WARNING: region SR1 entered" in text
    assert re.search(r"ATTITUDE +1:1 +10\.0 +11  5\.7 -11\.5 17\.2 deg", text)


def test_message_rates_track_arrivals_and_decay():
    table = TelemetryTable()
    for i in range(400):
        table.add(received(message("SYSTEM_TIME"), 0.05 * i))
        table.sample(0.05 * i)
    (row,) = table.rows.values()
    assert row.rate(20.0) == pytest.approx(20.0, rel=0.05)
    for i in range(100):
        table.sample(20.0 + 0.25 * i)
    assert row.rate(45.0) == 0.0


def test_silent_vehicle_is_marked_and_ground_stations_are_none(shown):
    assert "SILENT" not in shown(heartbeat(), now=3.0)[0][1]
    assert "SILENT for 9 s" in shown(heartbeat(), now=10.0)[0][1]
    lines, table = shown(received(heartbeat(autopilot=8, type=6), 1.0, system=255))
    assert table.vehicle is None and "no vehicle found" in lines


def test_memory_is_bounded_under_a_flood_of_names_and_texts(link):
    table = TelemetryTable()
    for i in range(20 * MAX_ROWS):
        table.add(received(message("NAMED_VALUE_FLOAT", name=f"n{i}".encode(), value=1.0), 1e-4 * i))
        table.add(received(message("STATUSTEXT", text=b"x"), 1e-4 * i, system=1 + i % 200))
        table.sample(1e-4 * i)
    assert len(table.rows) == MAX_ROWS and len(table.texts) == MAX_TEXTS
    assert table.total == 40 * MAX_ROWS and table.omitted > 0
    lines = format_table(link, table, 1.0, width=80, height=24)
    assert len(lines) == 24 and max(map(len, lines)) <= 80
    assert lines[-1].endswith("more rows")


@pytest.mark.parametrize(
    "sent",
    [
        message("STATUSTEXT", text=ESCAPE), message("NAMED_VALUE_FLOAT", name=ESCAPE[:10]),
        message("PARAM_VALUE", param_id=ESCAPE), message("AVAILABLE_MODES", custom_mode=6 << 16, mode_name=ESCAPE),
    ],
)  # fmt: skip
def test_received_text_cannot_inject_terminal_codes(shown, sent):
    decoded = mavlink.MAVLink(None).decode(bytearray(sent.pack(mavlink.MAVLink(None, 1, 1))))
    assert all(line.isprintable() for line in shown(heartbeat(), decoded, width=200)[0])


def test_every_message_of_the_dialect_is_displayed(shown):
    codec, frames = mavlink.MAVLink(None), []
    for number, kind in mavlink.mavlink_map.items():
        head = bytes([0xFD, 1, 0, 0, 0, 1, 1, *number.to_bytes(3, "little")])
        crc = mavlink.x25crc(head[1:] + b"\1" + bytes([kind.crc_extra])).crc
        frames.append(codec.decode(bytearray(head + b"\1" + crc.to_bytes(2, "little"))))
    lines, table = shown(*frames)
    names = {line.split()[0] for line in lines if "1:1" in line}
    assert len(table.rows) == min(MAX_ROWS, len(mavlink.mavlink_map)) and len(names) >= MAX_ROWS - 5


@pytest.mark.parametrize(
    ("sent", "text"),
    [
        (message("SYS_STATUS", load=500, voltage_battery=65535, current_battery=-1, battery_remaining=-1),
         "load 50.0 %  voltage_battery - V  current_battery - A  battery_remaining - %"),
        (message("SYS_STATUS", load=500, voltage_battery=15800, current_battery=250, battery_remaining=80),
         "load 50.0 %  voltage_battery 15.80 V  current_battery 2.50 A  battery_remaining 80 %"),
        (message("ATTITUDE", rollspeed=0.1), "0.0 0.0 0.0 deg  5.7 0.0 0.0 deg/s"),
        (message("ATTITUDE", roll=math.nan), "nan 0.0 0.0 deg  0.0 0.0 0.0 deg/s"),
        (message("SCALED_PRESSURE2", press_abs=1e3, temperature=2150), "press_abs 1000.00 hPa  temperature 21.5 degC"),
        (message("DISTANCE_SENSOR", current_distance=250), "current_distance 2.50 m"),
        (message("SYSTEM_TIME", time_boot_ms=12_340), "time_boot_ms 12.34 s"),
        (message("GLOBAL_POSITION_INT", hdg=27_050), "0.000000 0.000000 deg  relative_alt 0.00 m  hdg 270.5 deg"),
        (message("GLOBAL_POSITION_INT", lat=559_097_000, relative_alt=-3000, hdg=65535),
         "55.909700 0.000000 deg  relative_alt -3.00 m  hdg - deg"),
        (message("GPS2_RAW", vel=150),
         "fix_type 0  lat 0.000000 lon 0.000000 deg  alt 0 m  eph 0 epv 0  vel 1.5 m/s  cog 0 deg"),
        (message("VISION_POSITION_DELTA", position_delta=[0.004, 0.003, 0], confidence=90),
         "time_delta_usec 0 us  angle_delta [0 0 0] deg  position_delta [0.004 0.003 0] m  confidence 90 %"),
        (message("NAMED_VALUE_FLOAT", value=-123456.703125), "value -123456.7031"),
        (message("NAMED_VALUE_FLOAT", value=math.inf), "value inf"),
        (message("STATUSTEXT", text=b"Frame: VECTORED"), "Frame: VECTORED"),
        (message("WATER_DEPTH", healthy=1, alt=0.0, roll=0.1),
         "id 0 healthy 1  lat 0.000000 lng 0.000000 deg  alt 0 m  roll 5.72958 pitch 0 yaw 0 deg"),
        (message("ACTUATOR_OUTPUT_STATUS", active=3, actuator=[0.5] * 32), f"active 3 actuator [{'0.5 ' * 8}...]"),
    ],
)  # fmt: skip
def test_values_have_their_units(sent, text):
    assert format_values(sent) == text


def test_values_rounded_to_zero_have_no_sign(shown):
    small = {"roll": -1e-5, "yaw": -1e-5, "rollspeed": -1e-5, "pitchspeed": -0.0}
    lines, _ = shown(
        heartbeat(), message("ATTITUDE", **small), message("LOCAL_POSITION_NED", x=-1e-3, y=-0.0, z=-1e-3, vz=-1e-9),
        message("GLOBAL_POSITION_INT", relative_alt=1),
    )  # fmt: skip
    text = "\n".join(lines)
    assert "roll 0.0 pitch 0.0 yaw 0.0 deg" in text and "depth 0.00 m" in text
    assert not re.search(r"-0\.0+\b", text)


@pytest.mark.parametrize(
    ("autopilot", "number", "announced", "name"),
    [
        (12, 4 << 16 | 3 << 24, {}, "AUTO.LOITER"), (12, 6 << 16, {}, "OFFBOARD"), (3, 16, {}, "POSHOLD"),
        (3, 21, {}, "SURFTRAK"), (3, 22, {}, "22"), (3, 99, {}, "99"), (0, 7, {}, "7"),
        (0, 7, {7: "Region reaching"}, "Region reaching"),
    ],
)  # fmt: skip
def test_modes_have_their_names(autopilot, number, announced, name):
    assert mode_name(heartbeat(autopilot=autopilot, custom_mode=number), announced) == name


def test_broken_frames_are_ignored_and_mavlink_1_is_received(link):
    port, messages = int(link.name.rpartition(":")[2]), []
    send, rubbish = vehicle(port), udp_socket()
    rubbish.sendto(b"\xfd\xff\x00" + bytes(30), (HERE, port))
    send(heartbeat(), v1=True)
    rubbish.sendto(b"rubbish", (HERE, port))
    send(message("ATTITUDE"))
    while len(messages) < 2:
        messages += link.receive(2.0)
    assert [h.name for h in messages] == ["HEARTBEAT", "ATTITUDE"]
    assert link.stats.malformed == 2


def test_with_a_key_only_signed_frames_are_received():
    endpoint = parse_endpoint(f"udpin:{HERE}:{free_port()}")
    speaker = parse_endpoint(f"udpout:{HERE}:{endpoint.port}")
    with GroundLink(endpoint, key=bytes(32)) as link:
        for key in (None, b"\1" * 32, bytes(32)):
            with GroundLink(speaker, key, identity=(1, 1)) as vehicle:
                vehicle.send_heartbeat()
        messages = link.receive(2.0) + link.receive(0.1)
    assert [h.name for h in messages] == ["HEARTBEAT"]
    assert (link.stats.unsigned, link.stats.forged, link.stats.accepted) == (1, 1, 1)
    assert "1 frames forged" in format_table(link, TelemetryTable(), 0.0)[0]


def test_follow_ends_after_the_given_messages_or_seconds(link):
    send, table = vehicle(int(link.name.rpartition(":")[2])), TelemetryTable()
    for _ in range(9):
        send(heartbeat())
    assert len(list(follow(link, table, period=60.0, count=5))) == 1
    assert table.total == 5
    assert len(list(follow(link, table, period=0.05, seconds=0.2))) >= 2


@pytest.mark.parametrize(
    ("arguments", "status", "text"),
    [
        (["udpin:10.0.0.1:14550"], 2, "--allow-remote"), (["nonsense"], 2, "endpoint 'nonsense'"),
        (["new.tlog"], 2, "not a file"), ([f"udpin:{HERE}:0", "--seconds", "0.2"], 1, "no vehicle found"),
    ],
)  # fmt: skip
def test_invalid_endpoint_or_no_vehicle_is_an_error(arguments, status, text, capsys):
    arguments = [argument.replace(":0", f":{free_port()}") if status == 1 else argument for argument in arguments]
    assert main(["mavlink", "listen", *arguments]) == status
    out, error = capsys.readouterr()
    assert text in (error if status == 2 else out) and error.count("\n") == (status == 2)


@pytest.mark.slow
def test_terminal_display_redraws_in_place_and_ctrl_c_restores_the_cursor():
    port, seen = free_port(), b""
    send, command = vehicle(port), [sys.executable, "-m", "cosim", "mavlink", "listen", f"udpin:{HERE}:{port}"]
    leader, follower = pty.openpty()
    with subprocess.Popen(command, stdin=follower, stdout=follower, stderr=follower) as process:
        os.close(follower)
        while b"SUBMARINE" not in seen:
            send(heartbeat())
            if select.select([leader], [], [], 0.1)[0]:
                seen += os.read(leader, 65536)
        process.send_signal(signal.SIGINT)
        process.wait(120)
        while select.select([leader], [], [], 0.2)[0]:
            try:
                seen += os.read(leader, 65536)
            except OSError:
                break
    os.close(leader)
    assert process.returncode == 130
    assert seen.count(b"\x1b[?25l") == 1 == seen.count(b"\x1b[?25h")
    assert b"\x1b[H" in seen and b"interrupted" in seen
