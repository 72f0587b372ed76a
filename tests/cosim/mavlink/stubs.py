"""A stub vehicle, with frames and links for it."""

from __future__ import annotations

import socket
import time

from pymavlink import mavutil
from pymavlink.dialects.v20 import all as mavlink

from cosim.mavlink.channels.udp import UdpOut
from cosim.mavlink.wire.framing import FrameFilter, RxStats
from cosim.mavlink.wire.link import Link

HERE, SOURCE, KEY = "127.0.0.1", (1, 1), bytes(range(32))


def message(name, every=0, /, **values):
    """Return a message of the dialect, with one number in every field that has no value here."""
    kind = mavlink.mavlink_map[getattr(mavlink, f"MAVLINK_MSG_ID_{name}")]
    sizes, fields = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True)), []
    for field, form in zip(kind.fieldnames, kind.fieldtypes, strict=True):
        array = bytes([40 * every]) * max(sizes[field], 1) if form == "char" else [every] * sizes[field]
        fields.append(values.pop(field, array or every))
    assert not values
    return kind(*fields)


def heartbeat(**values):
    return message("HEARTBEAT", **{"type": 12, "system_status": 4, "mavlink_version": 3} | values)


def attitude(boot_ms):
    return message("ATTITUDE", 0.5, time_boot_ms=boot_ms)


def odometry(boot_us=1):
    return message("ODOMETRY", 1, time_usec=boot_us)


class StubVehicle:
    """Send one message per snapshot, record received messages, and acknowledge heartbeats."""

    def __init__(self):
        self.links, self.rows, self.received, self.ticks, self.closed = [], [], [], 0, False

    def attach(self, link):
        self.links.append(link)

    def observe(self, row):
        self.rows.append(row)
        for link in self.links:
            link.send(attitude(int(row[0] * 1000)))

    def receive(self, link, message, now):
        self.received.append(message)
        link.send(mavlink.MAVLink_command_ack_message(message.get_msgId(), 0))

    def tick(self, now):
        self.ticks += 1

    def close(self, now):
        self.closed = True
        for link in self.links:
            link.send(heartbeat())


class Codec:
    """Packs messages as a ground station does, and reads what the vehicle sends, all by pymavlink."""

    def __init__(self, system=255, component=190, key=None, link=7, stamp=None):
        self.codec = mavlink.MAVLink(None, system, component)
        self.codec.robust_parsing = True
        if key is not None:
            signing = self.codec.signing
            signing.secret_key, signing.sign_outgoing, signing.link_id = key, True, link
            signing.timestamp = int((time.time() - 1420070400) * 1e5) if stamp is None else stamp

    def pack(self, message, v1=False):
        frame = message.pack(self.codec, force_mavlink1=v1)
        self.codec.seq = (self.codec.seq + 1) % 256
        return frame

    def parse(self, data):
        return self.codec.parse_buffer(data) or []


def open_filter(verifier=None, own=SOURCE, allowed=None):
    return FrameFilter(RxStats(), own, allowed, verifier)


opened = []  # channels and sockets, closed after each test


def closed_later(thing):
    opened.append(thing)
    return thing


def link_of(channel, frame_filter=None, **options):
    return Link("test", closed_later(channel), frame_filter or open_filter(), SOURCE, **options)


def udp_socket(port=0):
    """Return a socket on a port of loopback; it is closed after the test."""
    made = closed_later(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    made.bind((HERE, port))
    made.settimeout(60.0)
    return made


def udp_link(port, **options):
    return link_of(UdpOut(HERE, port), **options)


def read_log(path):
    """Return the messages of a .tlog as pymavlink reads them."""
    reader, messages = mavutil.mavlink_connection(str(path), dialect="all"), []
    while (received := reader.recv_msg()) is not None:
        messages.append(received)
    reader.close()
    return messages


def free_port():
    """Return a UDP port that nobody listens on."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind((HERE, 0))
        return probe.getsockname()[1]


def until(condition, seconds=60.0):
    """Wait for a condition; return whether it became true."""
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.002)
    return True
