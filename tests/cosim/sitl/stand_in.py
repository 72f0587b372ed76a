"""An independent stand-in for ArduPilot that packs frames and parses answers as ArduPilot does."""

import re
import socket
import struct

import numpy as np

NUMBER = r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"

# section, key, how many numbers, required: in the order in which ArduPilot looks for them
KEYS = (
    ("", "timestamp", 0, True),
    ("imu", "gyro", 3, True),
    ("imu", "accel_body", 3, True),
    ("", "position", 3, True),
    ("", "attitude", 3, False),
    ("", "quaternion", 4, False),
    ("", "velocity", 3, True),
    *(("", f"rng_{i}", 0, False) for i in range(1, 7)),
    ("windvane", "direction", 0, False),
    ("windvane", "speed", 0, False),
    ("", "airspeed", 0, False),
    ("", "no_time_sync", 0, False),
)


def newest_line(data):
    """Return the text between the last two line ends."""
    last = data.rindex(b"\n")
    return data[data.rindex(b"\n", 0, last) + 1 : last].decode("ascii")


def parse(line):
    """Search the first occurrence of each bare key, and read on two characters behind it, without checks."""
    found = {}
    for section, key, n, required in KEYS:
        at = line.find(section)
        at = line.find(key, at + len(section) + 1) if at >= 0 else -1
        if at < 0:
            if required:
                raise ValueError(f"failed to find key {section}/{key}")
            continue
        rest = line[at + len(key) + 2 :]
        if n:  # sscanf with "[%f, %f, %f]": no blank before the bracket or a comma
            match = re.match(r"\[" + r",".join([r"\s*" + NUMBER] * n), rest)
            if not match:
                raise ValueError(f"failed to parse {section}/{key}")
            found[key] = tuple(map(float, match.groups()))
        else:  # atof
            match = re.match(r"\s*" + NUMBER, rest)
            found[key] = float(match.group(1)) if match else 0.0
    if "attitude" not in found and "quaternion" not in found:
        raise ValueError("did not receive attitude or quaternion")
    return found


def frame(count, pwm=(), rate=1200, channels=16):
    """A servo packet; outputs that are not given are at 0, as those without a function are."""
    magic = {16: 18458, 32: 29569}[channels]
    head = magic.to_bytes(2, "little") + rate.to_bytes(2, "little") + count.to_bytes(4, "little")
    return head + b"".join(struct.pack("<H", value) for value in [*pwm, *[0] * (channels - len(pwm))])


class StandIn:
    """Sends frames from a socket of its own, and waits for each answer."""

    def __init__(self, address, rate=1200, channels=16):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.settimeout(120.0)
        self.address, self.rate, self.channels = address, rate, channels
        self.count = 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def send(self, data):
        self.socket.sendto(data, self.address)

    def exchange(self, pwm=(), count=None):
        """Send a frame and return the answer's bytes; the count increases unless one is given."""
        self.send(frame(self.count if count is None else count, pwm, self.rate, self.channels))
        answer = self.socket.recv(65000)
        if count is None:
            self.count += 1
        return answer

    def fly(self, pwm=()):
        """Exchange one frame; return the parsed answer."""
        return parse(newest_line(self.exchange(pwm)))


# ArduSub's frame vectored_6dof: what each motor, above neutral, does forward, right, down, in roll, pitch, yaw
VECTORED_6DOF = np.array(
    [
        (-1, 1, 0, 0, 0, 1), (-1, -1, 0, 0, 0, -1), (1, 1, 0, 0, 0, -1), (1, -1, 0, 0, 0, 1),
        (0, 0, 1, 1, -1, 0), (0, 0, 1, -1, -1, 0), (0, 0, 1, 1, 1, 0), (0, 0, 1, -1, 1, 0),
    ]
)  # fmt: skip
DISARMED = (1500,) * 8
NEUTRAL = (1501,) * 8  # armed, inside the dead band


def heave(u):
    """Pulses of vectored_6dof that push down with u|u|, u from -1 to 1, by the vertical thrusters, 5 to 8."""
    return (*NEUTRAL[:4], *(round(1500 + 400 * u),) * 4)
