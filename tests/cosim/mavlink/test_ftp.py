"""File transfer, read with pymavlink's own client code."""

import struct
from functools import cache

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink import mavftp
from pymavlink.mavftp_op import FTP_OP

from tests.cosim.mavlink.station import Station, set_parameter
from tests.cosim.mavlink.stubs import message
from tests.cosim.mavlink.test_parameters import crc_by_bits, listed
from tests.examples import examples

TERMINATE, RESET, LISTING, OPEN, READ, CREATE, WRITE, CRC, BURST = 1, 2, 3, 4, 5, 6, 7, 14, 15
ACK, NAK = 128, 129
INVALID_SIZE, INVALID_SESSION, EOF, UNKNOWN, PROTECTED, NOT_FOUND = 3, 4, 6, 7, 9, 10
FILE = b"@PARAM/param.pck"


class Client:
    def __init__(self, station):
        self.station, self.seq = station, 0

    def request(self, opcode, data=b"", session=0, size=None, offset=0, **who):
        """Return all replies to a request."""
        self.seq += 2
        length = len(data) if size is None else size
        return self.send(FTP_OP(self.seq, session, opcode, length, 0, 0, offset, bytearray(data)).pack(), **who)

    def send(self, packet, **who):
        sent = message("FILE_TRANSFER_PROTOCOL", 1, target_network=0, payload=bytearray(packet).ljust(251, b"\0"))
        replies = [reply for reply in self.station.send(sent, **who) if reply.get_type() == "FILE_TRANSFER_PROTOCOL"]
        return [self.parse(bytes(reply.payload)) for reply in replies]

    def reply(self, opcode, data=b"", **request):
        """Return the one reply to a request."""
        (reply,) = self.request(opcode, data, **request)
        return reply

    @staticmethod
    def parse(raw):
        fields = struct.unpack_from("<HBBBBBBI", raw)
        return FTP_OP(*fields[:6], fields[7], raw[12 : 12 + fields[3]])

    def error(self, opcode, data=b"", **request):
        """Return the error of a refused request."""
        reply = self.reply(opcode, data, **request)
        assert (reply.opcode, reply.req_opcode, len(reply.payload)) == (NAK, opcode, 1)
        return reply.payload[0]

    def whole(self, path=FILE):
        opened, content = self.reply(OPEN, path), b""
        (length,) = struct.unpack("<I", opened.payload)
        while len(content) < length:
            burst = self.request(BURST, session=opened.session, size=239, offset=len(content))
            assert [b.burst_complete for b in burst] == [0] * (len(burst) - 1) + [1]
            assert [b.seq for b in burst] == [self.seq + i for i in range(1, len(burst) + 1)]
            for part in burst:
                assert part.offset == len(content)
                content += part.payload
        assert self.error(BURST, session=opened.session, size=239, offset=length) == EOF
        return content

    def parameters(self, query=b""):
        return [(name.decode(), x) for name, x, _ in mavftp.MAVFTP.ftp_param_decode(self.whole(FILE + query)).params]


@pytest.fixture
def client(station):
    return Client(station)


def test_parameter_file_equals_the_parameter_list_and_can_be_read_in_part(client):
    whole = client.parameters()
    assert whole == [(value.param_id, value.param_value) for value in listed(client.station)]
    assert client.parameters(b"?start=3&count=4&withdefaults=1") == whole[3:7]


def test_single_reads_return_data_until_end_of_file(client):
    content, session = client.whole(), client.reply(OPEN, FILE).session
    part = client.reply(READ, session=session, size=80, offset=40)
    assert (part.opcode, part.payload) == (ACK, content[40:120])
    assert client.error(READ, session=session, size=80, offset=len(content)) == EOF
    assert client.error(READ, session=session, size=240) == INVALID_SIZE


def test_file_crc_is_correct_and_folders_are_listed(client):
    content = client.whole()
    assert client.reply(CRC, FILE).payload == struct.pack("<I", crc_by_bits(content))
    assert client.reply(LISTING, b"/").payload == b"D@PARAM\0"
    assert client.reply(LISTING, b"@PARAM").payload == f"Fparam.pck\t{len(content)}\0".encode()
    assert client.error(LISTING, b"@PARAM", offset=1) == EOF


ELSEWHERE = (b"", b"/etc/passwd", b"../../etc/passwd", b"@PARAM/../etc/passwd", b"@SYS/threads.txt", b"@PARAM",
             b"\xff" * 239)  # fmt: skip
REFUSED = [*((OPEN, path, NOT_FOUND) for path in ELSEWHERE), *((op, FILE, PROTECTED) for op in (CREATE, WRITE, 8, 13)),
           (99, FILE, UNKNOWN)]  # fmt: skip


def test_other_paths_and_write_operations_are_refused(client):
    assert [client.error(opcode, path) for opcode, path, _ in REFUSED] == [error for *_, error in REFUSED]


def test_terminated_session_is_invalid(client):
    assert client.error(READ, session=client.reply(OPEN, FILE).session + 1, size=10) == INVALID_SESSION
    for end in (TERMINATE, RESET):
        session = client.reply(OPEN, FILE).session
        assert client.reply(end, session=session).opcode == ACK
        assert client.error(READ, session=session, size=10) == INVALID_SESSION


def test_a_file_that_is_open_does_not_change(client):
    before, session = client.whole(), client.reply(OPEN, FILE).session
    client.station.send(set_parameter("GOAL_RADIUS", 0.9))
    assert client.reply(READ, session=session, size=200).payload == before[:200]
    assert client.whole() != before


def test_repeated_request_gets_the_same_reply(client):
    packet = FTP_OP(5, 0, OPEN, len(FILE), 0, 0, 0, bytearray(FILE)).pack()
    assert [bytes(r.payload) for r in client.send(packet)] == [bytes(r.payload) for r in client.send(packet)]


@pytest.mark.parametrize("session", [0, 1, 7, 255])
def test_replies_echo_the_session_that_the_station_chose(client, session):
    """MAVProxy counts its sessions, and drops a reply of another one."""
    for opcode, data in ((LISTING, b"/"), (OPEN, FILE), (READ, b""), (BURST, b""), (TERMINATE, b""), (OPEN, b"no")):
        replies = client.request(opcode, data, session=session, size=len(data) or 40)
        assert {reply.session for reply in replies} == {session}


def test_stations_do_not_share_a_session(client):
    for system in range(240, 248):  # all choose the same number
        assert client.reply(OPEN, FILE + b"?start=%d" % (system - 240), system=system).session == 0
    assert len({client.reply(READ, size=40, system=system).payload for system in range(240, 248)}) == 8
    for system in range(2, 200):  # many more: the oldest go
        assert client.reply(OPEN, FILE, system=system).opcode == ACK
    assert client.reply(READ, size=40, system=199).opcode == ACK
    assert client.error(READ, size=40, system=2) == INVALID_SESSION


any_station = cache(Station)


@settings(max_examples=examples(200), deadline=None)
@given(st.binary(max_size=251))
def test_any_payload_is_answered_at_most_with_a_burst(payload):
    assert len(Client(any_station()).send(payload)) <= 16
