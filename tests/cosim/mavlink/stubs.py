"""A stub vehicle, with frames and links for it."""

from __future__ import annotations

import socket
import time

from pymavlink import mavutil
from pymavlink.dialects.v20 import all as mavlink

from cosim.mavlink.channels.udp import UdpOut
from cosim.mavlink.wire.framing import FrameFilter, RxStats
from cosim.mavlink.wire.link import Link

SOURCE = (1, 1)
KEY = bytes(range(32))


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


def heartbeat():
    return mavlink.MAVLink_heartbeat_message(12, 0, 0, 0, 4, 3)


def attitude(boot_ms):
    return mavlink.MAVLink_attitude_message(boot_ms, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)


def odometry(boot_us=1):
    return mavlink.MAVLink_odometry_message(
        boot_us, 1, 12, 1.5, 2.5, 3.5, [1.0, 0.1, 0.2, 0.3], *[0.5] * 6, [0.25] * 21, [0.75] * 21, 0, 8, 100
    )


def request_list(target=1):
    return mavlink.MAVLink_param_request_list_message(target, 1)


class Station:
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


def link_of(channel, **options):
    return Link("test", closed_later(channel), open_filter(), SOURCE, **options)


def udp_socket(port=0):
    """Return a socket on a port of loopback; it is closed after the test."""
    made = closed_later(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    made.bind(("127.0.0.1", port))
    made.settimeout(60.0)
    return made


def udp_link(port, **options):
    return link_of(UdpOut("127.0.0.1", port), **options)


def send_now(link, message):
    """Send a message at once; return whether there was room for it."""
    sent = link.send(message)
    link.channel.poll(time.monotonic())
    return sent


def read_log(path):
    """Return the messages of a .tlog as pymavlink reads them."""
    reader, messages = mavutil.mavlink_connection(str(path), dialect="all"), []
    while (message := reader.recv_msg()) is not None:
        messages.append(message)
    reader.close()
    return messages


def free_port():
    """Return a UDP port that nobody listens on."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def until(condition, seconds=60.0):
    """Wait for a condition; return whether it became true."""
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.002)
    return True
