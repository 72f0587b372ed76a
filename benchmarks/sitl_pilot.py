"""A stand-in for ArduPilot, as a process: sends each frame after the answer to the last, and prints the time."""

from __future__ import annotations

import socket
import struct
import sys
import time

RATE = 1200  # Hz, ArduPilot's default
WARMING = 100  # number of frames before the timing starts
HEAD = struct.Struct("<HHI")  # head of a packet: MAGIC, rate [Hz], number of the frame
MAGIC = 18458
# pulses of 16 outputs [us]
PULSES = struct.pack("<16H", *[1500] * 4, *[1700] * 4, *[0] * 8)


def main(port: int, frames: int) -> None:
    """Fly with a port of this machine, and print the time of the frames [s]."""
    started = time.perf_counter()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.connect(("127.0.0.1", port))
        for count in range(WARMING + frames):
            if count == WARMING:
                started = time.perf_counter()
            link.send(HEAD.pack(MAGIC, RATE, count) + PULSES)
            link.recv(65000)
    print(time.perf_counter() - started)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
