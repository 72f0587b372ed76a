"""Datagrams that no ground station sends: ``python -m benchmarks.hostile PORT COUNT SEED`` floods a port with them."""

from __future__ import annotations

import random
import socket
import sys
from collections.abc import Iterator
from typing import Any

from cosim.mavlink.wire.dialect import dialect

_PREPARED = 4096  # number of datagrams that a flood repeats, since making them takes longer than sending them


def hostile_datagrams(count: int, seed: int) -> Iterator[bytes]:
    """Yield random, truncated, bit-flipped, wrongly long and unsolicited frames in turn."""
    # one in five is a valid request for all parameters, each from another sender
    rng, mavlink = random.Random(seed), dialect()
    codec = mavlink.MAVLink(None, 255, 190)
    good = [message.pack(codec) for message in _good_messages(mavlink, rng)]
    for i in range(count):
        frame = bytearray(rng.choice(good))
        at = rng.randrange(len(frame))
        if i % 5 == 0:
            frame = bytearray(rng.randbytes(rng.randrange(300)))
            if frame:
                frame[0] = rng.choice((0xFD, 0xFE, frame[0]))
        elif i % 5 == 1:
            del frame[at:]
        elif i % 5 == 2:
            frame[at] ^= 1 << rng.randrange(8)
        elif i % 5 == 3:
            frame[1] = rng.randrange(256)
            frame += rng.randbytes(rng.randrange(1500))
        else:
            codec.srcSystem, codec.srcComponent = rng.randrange(2, 256), rng.randrange(1, 256)
            frame = bytearray(mavlink.MAVLink_param_request_list_message(rng.choice((0, 1)), 1).pack(codec))
        yield bytes(frame)


def _good_messages(mavlink: Any, rng: random.Random) -> list[Any]:
    return [
        mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3),
        mavlink.MAVLink_command_long_message(1, 1, 400, 0, *[rng.random() for _ in range(7)]),
        mavlink.MAVLink_param_set_message(1, 1, b"GAIN", rng.random(), 9),
        mavlink.MAVLink_manual_control_message(1, 500, -500, 500, 0, 1),
        mavlink.MAVLink_mission_count_message(1, 1, 60_000),
        mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, [rng.randrange(256) for _ in range(251)]),
        mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 0, *[1e30] * 11),
    ]


def flood(port: int, count: int, seed: int) -> None:
    """Send hostile datagrams to a port of this machine, as fast as possible."""
    prepared = list(hostile_datagrams(min(count, _PREPARED), seed))
    print("ready", flush=True)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for i in range(count):
            sender.sendto(prepared[i % len(prepared)], ("127.0.0.1", port))


if __name__ == "__main__":
    flood(*map(int, sys.argv[1:4]))
