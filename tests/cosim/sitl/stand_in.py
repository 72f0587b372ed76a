"""Independent stand-ins that pack frames and parse answers by hand: for ArduPilot as it does, for PX4 by MAVLink 2."""

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

# id: extra byte of the checksum, and the payload's fields as they go over the wire
MESSAGES = {
    0: (50, "<IBBBBB"),
    93: (47, "<QQ16fB"),
    107: (108, "<Q13fIB"),
    113: (124, "<QiiiHHHhhhHBB"),
    115: (4, "<Q4f3fiiihhhHHhhh"),
}
ARMED = 128


def checksum(data):
    """CRC-16/MCRF4XX, as MAVLink has it."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x8408 if crc & 1 else 0)
    return crc


def packed(number, *values, sequence=0):
    extra, layout = MESSAGES[number]
    payload = struct.pack(layout, *values).rstrip(b"\0") or b"\0"
    frame = bytes([len(payload), 0, 0, sequence % 256, 1, 1]) + number.to_bytes(3, "little") + payload
    return b"\xfd" + frame + checksum(frame + bytes([extra])).to_bytes(2, "little")


class Px4(Peer):
    """Takes sensors and answers them."""

    def __init__(self, address):
        self.socket = socket.create_connection(address, timeout=120.0)
        self.data, self.seen, self.frames = b"", {}, 0
        self.say(packed(0, 0, 2, 12, 0, 4, 3))

    def say(self, data):
        self.socket.sendall(data)

    def message(self):
        """The next message's number and fields; its checksum must be right."""
        while len(self.data) < 12 or len(self.data) < 12 + self.data[1]:
            data = self.socket.recv(4096)
            if not data:
                raise EOFError
            self.data += data
        n = self.data[1]
        frame, self.data = self.data[: 12 + n], self.data[12 + n :]
        assert frame[0] == 0xFD
        number = int.from_bytes(frame[7:10], "little")
        extra, layout = MESSAGES[number]
        assert checksum(frame[1:-2] + bytes([extra])) == int.from_bytes(frame[-2:], "little")
        size = struct.calcsize(layout)  # zeros at the end are left out, extensions come behind it
        return number, struct.unpack(layout, frame[10:-2].ljust(size, b"\0")[:size])

    def sensors(self):
        """Return the next HIL_SENSOR; earlier messages are in `seen`."""
        while True:
            number, fields = self.message()
            self.seen[number] = fields
            if number == 107:
                return fields

    def answer(self, controls, mode=ARMED):
        values = (*controls, *[0.0] * (16 - len(controls)))
        self.say(packed(93, self.frames, 1, *values, mode, sequence=self.frames))
        self.frames += 1

    def fly(self, controls, frames=1):
        """Answer so many frames of sensors, perhaps by a function of them; return the last."""
        for _ in range(frames):
            fields = self.sensors()
            self.answer(controls(fields) if callable(controls) else controls)
        return fields


def down(u):
    return (0.0,) * 4 + (-u,) * 4
