"""Stand-ins: an ArduPilot that packs frames and parses answers by hand as it does, and a PX4 by pymavlink."""

import contextlib
import re
import socket
import struct
from collections import deque

import numpy as np
from pymavlink.dialects.v20 import all as mavlink

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


class Peer:
    """Closes its socket with its context."""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()


class StandIn(Peer):
    """Sends frames from a socket of its own, and waits for each answer."""

    def __init__(self, address, rate=1200, channels=16):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.settimeout(120.0)
        self.address, self.rate, self.channels = address, rate, channels
        self.count = 0

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


# ---- PX4 ----

ARMED = 128


def controls_message(controls, mode=ARMED, frame=0):
    return mavlink.MAVLink_hil_actuator_controls_message(frame, [*controls, *[0.0] * (16 - len(controls))], mode, 1)


class Px4(Peer):
    """Takes sensors and answers them."""

    def __init__(self, address):
        self.socket = socket.create_connection(address, timeout=120.0)
        self.codec, self.coming, self.seen, self.frames = mavlink.MAVLink(None, 1, 1), deque(), {}, 0
        self.say(mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3).pack(self.codec))

    def __exit__(self, *_):
        with contextlib.suppress(OSError):  # what is closed with data unread takes back what it has sent last
            self.socket.shutdown(socket.SHUT_WR)
            while self.socket.recv(4096):
                pass
        self.socket.close()

    def say(self, data):
        self.socket.sendall(data)

    def sensors(self):
        """Return the next HIL_SENSOR; `seen` has the newest message of each type."""
        while True:
            while not self.coming:
                data = self.socket.recv(4096)
                if not data:
                    raise EOFError
                self.coming += self.codec.parse_buffer(data) or ()
            message = self.coming.popleft()
            self.seen[message.get_type()] = message
            if message.get_type() == "HIL_SENSOR":
                return message

    def answer(self, controls, mode=ARMED):
        self.say(controls_message(controls, mode, self.frames).pack(self.codec))
        self.codec.seq = (self.codec.seq + 1) % 256
        self.frames += 1

    def fly(self, controls, frames=1):
        """Answer so many frames of sensors, perhaps by a function of them; return the last."""
        for _ in range(frames):
            sensors = self.sensors()
            self.answer(controls(sensors) if callable(controls) else controls)
        return sensors


def down(u):
    return (0.0,) * 4 + (-u,) * 4
