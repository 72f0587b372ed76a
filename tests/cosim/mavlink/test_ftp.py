"""File transfer, read with pymavlink's own client code."""

import struct
from functools import cache

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink import mavftp
from pymavlink.dialects.v20 import all as mavlink
from pymavlink.mavftp_op import FTP_OP

from tests.cosim.mavlink.station import Station
from tests.cosim.mavlink.test_parameters import LIST, crc_by_bits
from tests.examples import examples

TERMINATE, RESET, LISTING, OPEN, READ, CREATE, WRITE, CRC, BURST = 1, 2, 3, 4, 5, 6, 7, 14, 15
ACK, NAK = 128, 129
INVALID_SIZE, INVALID_SESSION, EOF, UNKNOWN, PROTECTED, NOT_FOUND = 3, 4, 6, 7, 9, 10
FILE = b"@PARAM/param.pck"


class Client:
    def __init__(self, station):
        self.station, self.seq = station, 0

    def request(self, opcode, data=b"", session=0, size=None, offset=0, **who):
        self.seq += 2
        packet = FTP_OP(
            self.seq, session, opcode, len(data) if size is None else size, 0, 0, offset, bytearray(data)
        ).pack()
        return self.send(packet, **who)

    def send(self, packet, **who):
        payload = bytearray(packet).ljust(251, b"\0")
        replies = self.station.send(mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, payload), **who)
        return [self.parse(reply) for reply in replies if reply.get_type() == "FILE_TRANSFER_PROTOCOL"]

    @staticmethod
    def parse(message):
        raw = bytes(message.payload)
        fields = struct.unpack_from("<HBBBBBBI", raw)
        return FTP_OP(*fields[:6], fields[7], raw[12 : 12 + fields[3]])

    def whole(self, path=FILE):
        (opened,) = self.request(OPEN, path)
        (length,) = struct.unpack("<I", opened.payload)
        content = b""
        while len(content) < length:
            burst = self.request(BURST, session=opened.session, size=239, offset=len(content))
            assert [b.burst_complete for b in burst] == [0] * (len(burst) - 1) + [1]
            assert [b.seq for b in burst] == [self.seq + i for i in range(1, len(burst) + 1)]
            for part in burst:
                assert part.offset == len(content)
                content += part.payload
        assert self.request(BURST, session=opened.session, size=239, offset=length)[0].payload[0] == EOF
        return content


@pytest.fixture
def client():
    station = Station("ardusub")
    station.look()
    return Client(station)


def test_parameter_file_equals_the_parameter_list(client):
    decoded = mavftp.MAVFTP.ftp_param_decode(client.whole())
    client.station.send(LIST)
    client.station.wait(0.1)
    values = client.station.wire.of("PARAM_VALUE")
    assert [(name.decode(), value) for name, value, _ in decoded.params] == [
        (v.param_id, v.param_value) for v in values
    ]


def test_parameter_file_can_be_read_in_part(client):
    decoded = mavftp.MAVFTP.ftp_param_decode(client.whole(FILE + b"?start=3&count=4&withdefaults=1"))
    whole = mavftp.MAVFTP.ftp_param_decode(client.whole())
    assert [p[:2] for p in decoded.params] == [p[:2] for p in whole.params][3:7]


def test_single_reads_return_data_until_end_of_file(client):
    content = client.whole()
    (opened,) = client.request(OPEN, FILE)
    (part,) = client.request(READ, session=opened.session, size=80, offset=40)
    assert (part.opcode, part.payload) == (ACK, content[40:120])
    for size, offset, error in ((80, len(content), EOF), (240, 0, INVALID_SIZE)):
        (end,) = client.request(READ, session=opened.session, size=size, offset=offset)
        assert (end.opcode, end.payload) == (NAK, bytes([error]))


def test_file_crc_is_correct(client):
    (reply,) = client.request(CRC, FILE)
    assert struct.unpack("<I", reply.payload)[0] == crc_by_bits(client.whole())


def test_folders_are_listed(client):
    assert client.request(LISTING, b"/")[0].payload == b"D@PARAM\0"
    assert client.request(LISTING, b"@PARAM")[0].payload == f"Fparam.pck\t{len(client.whole())}\0".encode()
    assert client.request(LISTING, b"@PARAM", offset=1)[0].payload[0] == EOF


ELSEWHERE = (b"", b"/etc/passwd", b"../../etc/passwd", b"@PARAM/../etc/passwd", b"@SYS/threads.txt", b"@PARAM",
             b"\xff" * 239)  # fmt: skip
REFUSED = [*((OPEN, path, NOT_FOUND) for path in ELSEWHERE), *((op, FILE, PROTECTED) for op in (CREATE, WRITE, 8, 13)),
           (99, FILE, UNKNOWN)]  # fmt: skip


@pytest.mark.parametrize(("opcode", "path", "error"), REFUSED)
def test_other_paths_and_write_operations_are_refused(client, opcode, path, error):
    (reply,) = client.request(opcode, path)
    assert (reply.opcode, reply.payload[0], reply.req_opcode) == (NAK, error, opcode)


def test_terminated_session_is_invalid(client):
    (opened,) = client.request(OPEN, FILE)
    assert client.request(READ, session=opened.session + 1, size=10)[0].payload[0] == INVALID_SESSION
    for end in (TERMINATE, RESET):
        (opened,) = client.request(OPEN, FILE)
        assert client.request(end, session=opened.session)[0].opcode == ACK
        assert client.request(READ, session=opened.session, size=10)[0].payload[0] == INVALID_SESSION


def test_a_file_that_is_open_does_not_change(client):
    before = client.whole()
    (opened,) = client.request(OPEN, FILE)
    client.station.send(mavlink.MAVLink_param_set_message(1, 1, b"GOAL_RADIUS", 0.9, 9))
    (part,) = client.request(READ, session=opened.session, size=200)
    assert part.payload == before[:200]
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
        assert client.request(OPEN, FILE + b"?start=%d" % (system - 240), system=system)[0].session == 0
    heads = [client.request(READ, size=40, system=system)[0].payload for system in range(240, 248)]
    assert len(set(heads)) == 8
    for system in range(2, 200):  # many more: the oldest go
        assert client.request(OPEN, FILE, system=system)[0].opcode == ACK


@settings(max_examples=examples(200), deadline=None)
@given(st.binary(max_size=251))
def test_any_payload_is_answered_at_most_with_a_burst(payload):
    assert len(Client(any_station()).send(payload)) <= 16


any_station = cache(Station)
