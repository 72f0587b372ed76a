"""``cosim mavlink listen``: known vehicles, their display, bounded memory, and terminal safety."""

import math
import os
import pty
import re
import select
import signal
import subprocess
import sys
import time

import pytest
from pymavlink.dialects.v20 import all as mavlink

from cosim.command_line.cli import main
from cosim.mavlink.listening import TelemetryTable, follow, format_table
from cosim.mavlink.listening.fields import format_values
from cosim.mavlink.listening.table_text import mode_name
from cosim.mavlink.listening.telemetry_table import MAX_ROWS, MAX_TEXTS
from cosim.mavlink.wire.endpoint import parse_endpoint
from cosim.mavlink.wire.ground_end import GroundLink, ReceivedMessage
from tests.cosim.mavlink.stubs import Station, free_port, udp_socket

ESCAPE = "\x1b[31mred\x07"


def heartbeat(autopilot=12, base_mode=0x81, custom_mode=6 << 16, kind=12):
    return mavlink.MAVLink_heartbeat_message(kind, autopilot, base_mode, custom_mode, 4, 3)


def received(message, at=0.0, system=1, component=1):
    return ReceivedMessage(at, system, component, 0, message.get_type(), message)


@pytest.fixture
def link():
    with GroundLink(parse_endpoint(f"udpin:127.0.0.1:{free_port()}")) as link:
        yield link


def vehicle(port):
    """Return a function that sends messages to a port, with pymavlink's encoder alone."""
    station, sender = Station(1, 1), udp_socket()
    return lambda message, v1=False: sender.sendto(station.pack(message, v1), ("127.0.0.1", port))


def test_display_shows_vehicle_position_texts_and_messages(link):
    watch = TelemetryTable()
    for i in range(11):
        watch.add(received(mavlink.MAVLink_attitude_message(100 * i, 0.1, -0.2, 0.3, 0, 0, 0), 0.1 * i))
    watch.add(received(heartbeat(), 1.0))
    watch.add(received(mavlink.MAVLink_local_position_ned_message(0, 1.5, -2.25, 3.0, 0, 0, 0), 1.0))
    watch.add(received(mavlink.MAVLink_global_position_int_message(0, 0, 0, 0, -3000, 0, 0, 0, 0), 1.0))
    watch.add(received(mavlink.MAVLink_statustext_message(4, b"region SR1 entered"), 1.0))
    text = "\n".join(format_table(link, watch, 1.0))
    assert "vehicle 1:1 PX4 SUBMARINE, mode OFFBOARD, ARMED, ACTIVE" in text
    assert "north 1.50 east -2.25 down 3.00 m, roll 5.7 pitch -11.5 yaw 17.2 deg, depth 3.00 m" in text
    assert "WARNING: region SR1 entered" in text
    assert re.search(r"ATTITUDE +1:1 +10\.0 +11  roll pitch yaw|ATTITUDE +1:1 +10\.0 +11  5\.7 -11\.5 17\.2 deg", text)


def test_message_rates_track_arrivals_and_decay():
    watch = TelemetryTable()
    for i in range(400):
        watch.add(received(mavlink.MAVLink_system_time_message(0, 0), 0.05 * i))
        watch.sample(0.05 * i)
    (row,) = watch.rows.values()
    assert row.rate(20.0) == pytest.approx(20.0, rel=0.05)
    for i in range(100):
        watch.sample(20.0 + 0.25 * i)
    assert row.rate(45.0) == 0.0


def test_silent_vehicle_is_marked_silent(link):
    watch = TelemetryTable()
    watch.add(received(heartbeat(), 1.0))
    assert "SILENT" not in format_table(link, watch, 3.0)[1]
    assert "SILENT for 9 s" in format_table(link, watch, 10.0)[1]


def test_ground_stations_are_no_vehicle(link):
    watch = TelemetryTable()
    watch.add(received(heartbeat(autopilot=8, kind=6), 1.0, system=255))
    assert watch.vehicle is None
    assert "no vehicle found" in format_table(link, watch, 1.0)


def test_memory_is_bounded_under_a_flood_of_names_and_texts(link):
    watch = TelemetryTable()
    for i in range(20 * MAX_ROWS):
        watch.add(received(mavlink.MAVLink_named_value_float_message(0, f"n{i}".encode(), 1.0), 1e-4 * i))
        watch.add(received(mavlink.MAVLink_statustext_message(6, b"x"), 1e-4 * i, system=1 + i % 200))
        watch.sample(1e-4 * i)
    assert len(watch.rows) == MAX_ROWS and len(watch.texts) == MAX_TEXTS
    assert watch.total == 40 * MAX_ROWS and watch.omitted > 0
    lines = format_table(link, watch, 1.0, width=80, height=24)
    assert len(lines) == 24 and max(map(len, lines)) <= 80
    assert lines[-1].endswith("more rows")


@pytest.mark.parametrize(
    "message",
    [
        mavlink.MAVLink_statustext_message(6, ESCAPE.encode()),
        mavlink.MAVLink_named_value_float_message(0, ESCAPE.encode()[:10], 1.0),
        mavlink.MAVLink_param_value_message(ESCAPE.encode(), 1.0, 9, 1, 0),
        mavlink.MAVLink_available_modes_message(1, 1, 0, 6 << 16, 0, ESCAPE.encode()),
    ],
)
def test_received_text_cannot_inject_terminal_codes(link, message):
    decoded = mavlink.MAVLink(None).decode(bytearray(message.pack(mavlink.MAVLink(None, 1, 1))))
    watch = TelemetryTable()
    watch.add(received(heartbeat()))
    watch.add(received(decoded))
    assert all(line.isprintable() for line in format_table(link, watch, 1.0, width=200))


def test_every_message_of_the_dialect_is_displayed(link):
    watch, codec = TelemetryTable(), mavlink.MAVLink(None)
    for number, kind in mavlink.mavlink_map.items():
        head = bytes([0xFD, 1, 0, 0, 0, 1, 1, *number.to_bytes(3, "little")])
        crc = mavlink.x25crc(head[1:] + b"\1" + bytes([kind.crc_extra])).crc
        watch.add(received(codec.decode(bytearray(head + b"\1" + crc.to_bytes(2, "little")))))
    shown = {line.split()[0] for line in format_table(link, watch, 1.0) if "1:1" in line}
    assert len(watch.rows) == min(MAX_ROWS, len(mavlink.mavlink_map)) and len(shown) >= MAX_ROWS - 5


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (mavlink.MAVLink_sys_status_message(0, 0, 0, 500, 65535, -1, -1, *[0] * 6),
         "load 50.0 %  voltage_battery - V  current_battery - A  battery_remaining - %"),
        (mavlink.MAVLink_sys_status_message(0, 0, 0, 500, 15800, 250, 80, *[0] * 6),
         "load 50.0 %  voltage_battery 15.80 V  current_battery 2.50 A  battery_remaining 80 %"),
        (mavlink.MAVLink_attitude_message(0, 0, 0, 0, 0.1, 0, 0), "0.0 0.0 0.0 deg  5.7 0.0 0.0 deg/s"),
        (mavlink.MAVLink_scaled_pressure2_message(0, 1013.25, 0, 2150), "press_abs 1013.25 hPa  temperature 21.5 degC"),
        (mavlink.MAVLink_distance_sensor_message(0, 0, 0, 250, 0, 0, 25, 0), "current_distance 2.50 m"),
        (mavlink.MAVLink_system_time_message(0, 12_340), "time_boot_ms 12.34 s"),
        (mavlink.MAVLink_global_position_int_message(0, 0, 0, 0, 0, 0, 0, 0, 27_050),
         "0.000000 0.000000 deg  relative_alt 0.00 m  hdg 270.5 deg"),
        (mavlink.MAVLink_gps2_raw_message(0, 0, 0, 0, 0, 0, 0, 150, 0, 0, 0, 0),
         "fix_type 0  lat 0.000000 lon 0.000000 deg  alt 0 m  eph 0 epv 0  vel 1.5 m/s  cog 0 deg"),
        (mavlink.MAVLink_vision_position_delta_message(0, 0, [0, 0, 0], [0.004, 0.003, 0], 90),
         "time_delta_usec 0 us  angle_delta [0 0 0] deg  position_delta [0.004 0.003 0] m  confidence 90 %"),
        (mavlink.MAVLink_named_value_float_message(0, b"x", -123456.703125), "value -123456.7031"),
        (mavlink.MAVLink_statustext_message(6, b"Frame: VECTORED"), "Frame: VECTORED"),
        (mavlink.MAVLink_attitude_message(0, math.nan, 0, 0, 0, 0, 0), "nan 0.0 0.0 deg  0.0 0.0 0.0 deg/s"),
        (mavlink.MAVLink_named_value_float_message(0, b"x", math.inf), "value inf"),
        (mavlink.MAVLink_global_position_int_message(0, 559_097_000, 0, 0, -3000, 0, 0, 0, 65535),
         "55.909700 0.000000 deg  relative_alt -3.00 m  hdg - deg"),
        (mavlink.MAVLink_water_depth_message(0, 0, 1, 0, 0, 0.0, 0.1, 0, 0, 2.5, 0),
         "id 0 healthy 1  lat 0.000000 lng 0.000000 deg  alt 0 m  roll 5.72958 pitch 0 yaw 0 deg"),
        (mavlink.MAVLink_actuator_output_status_message(0, 3, [0.5] * 32),
         f"active 3 actuator [{'0.5 ' * 8}...]"),
    ],
)  # fmt: skip
def test_values_have_their_units(message, text):
    assert format_values(message) == text


def test_values_rounded_to_zero_have_no_sign(link):
    watch = TelemetryTable()
    attitude = mavlink.MAVLink_attitude_message(0, -1e-5, 0.0, -1e-5, -1e-5, -0.0, 0.0)
    place = mavlink.MAVLink_local_position_ned_message(0, -1e-3, -0.0, -1e-3, 0.0, 0.0, -1e-9)
    world = mavlink.MAVLink_global_position_int_message(0, 0, 0, 0, 1, 0, 0, 0, 0)
    for message in (heartbeat(), attitude, place, world):
        watch.add(received(message))
    shown = "\n".join(format_table(link, watch, 1.0))
    assert "roll 0.0 pitch 0.0 yaw 0.0 deg" in shown and "depth 0.00 m" in shown
    assert not re.search(r"-0\.0+\b", shown)


@pytest.mark.parametrize(
    ("autopilot", "number", "told", "name"),
    [
        (12, 4 << 16 | 3 << 24, {}, "AUTO.LOITER"),
        (12, 6 << 16, {}, "OFFBOARD"),
        (3, 16, {}, "POSHOLD"),
        (3, 21, {}, "SURFTRAK"),
        (3, 99, {}, "99"),
        (0, 7, {}, "7"),
        (0, 7, {7: "Region reaching"}, "Region reaching"),
    ],
)
def test_modes_have_their_names(autopilot, number, told, name):
    assert mode_name(heartbeat(autopilot, custom_mode=number), told) == name


def test_broken_frames_are_ignored_and_mavlink_1_is_received(link):
    port = int(link.name.rpartition(":")[2])
    send, rubbish, found = vehicle(port), udp_socket(), []
    rubbish.sendto(b"\xfd\xff\x00" + bytes(30), ("127.0.0.1", port))
    send(heartbeat(), v1=True)
    rubbish.sendto(b"rubbish", ("127.0.0.1", port))
    send(mavlink.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 0))
    while len(found) < 2:
        found += link.receive(2.0)
    assert [h.name for h in found] == ["HEARTBEAT", "ATTITUDE"]
    assert link.v1_frames == 1 and link.stats.malformed == 2


def test_with_a_key_only_signed_frames_are_received():
    endpoint = parse_endpoint(f"udpin:127.0.0.1:{free_port()}")
    speaker = parse_endpoint(f"udpout:127.0.0.1:{endpoint.port}")
    with GroundLink(endpoint, key=bytes(32)) as link:
        for key in (None, b"\1" * 32, bytes(32)):
            with GroundLink(speaker, key, identity=(1, 1)) as vehicle:
                vehicle.send_heartbeat()
        found = link.receive(2.0) + link.receive(0.1)
    assert [h.name for h in found] == ["HEARTBEAT"]
    assert (link.stats.unsigned, link.stats.forged, link.stats.accepted) == (1, 1, 1)
    assert "1 frames forged" in format_table(link, TelemetryTable(), 0.0)[0]


def test_follow_ends_after_the_given_messages_or_seconds(link):
    port = int(link.name.rpartition(":")[2])
    send, watch = vehicle(port), TelemetryTable()
    for _ in range(9):
        send(heartbeat())
    assert len(list(follow(link, watch, period=60.0, count=5))) == 1
    assert watch.total == 5
    assert len(list(follow(link, watch, period=0.05, seconds=0.2))) >= 2


@pytest.mark.slow
def test_listen_command_prints_the_display():
    port = free_port()
    send, command = vehicle(port), [sys.executable, "-m", "cosim", "mavlink", "listen", f"udpin:127.0.0.1:{port}"]
    with subprocess.Popen([*command, "--count", "3"], stdout=subprocess.PIPE) as process:
        while process.poll() is None:
            send(heartbeat())
            time.sleep(0.05)
        text = process.stdout.read().decode()
    assert process.returncode == 0
    assert "3 messages" in text and "PX4 SUBMARINE" in text and "\x1b" not in text


def test_receiving_no_vehicle_exits_with_1(capsys):
    assert main(["mavlink", "listen", f"udpin:127.0.0.1:{free_port()}", "--seconds", "0.2"]) == 1
    assert "no vehicle found" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "text"),
    [(["udpin:10.0.0.1:14550"], "--allow-remote"), (["nonsense"], "endpoint 'nonsense'"), (["new.tlog"], "not a file")],
)
def test_invalid_endpoint_gives_one_line_error(arguments, text, capsys):
    assert main(["mavlink", "listen", *arguments]) == 2
    error = capsys.readouterr().err
    assert text in error and error.count("\n") == 1


@pytest.mark.slow
def test_terminal_display_redraws_in_place_and_ctrl_c_restores_the_cursor():
    port = free_port()
    send, command = vehicle(port), [sys.executable, "-m", "cosim", "mavlink", "listen", f"udpin:127.0.0.1:{port}"]
    leader, follower = pty.openpty()
    with subprocess.Popen(command, stdin=follower, stdout=follower, stderr=follower) as process:
        os.close(follower)
        seen = b""
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
