"""File transfer: a station asks for the parameter file, is refused at once, and gets the list."""

import struct
from functools import cache

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.mavftp_op import FTP_OP

from tests.cosim.mavlink.station import Station
from tests.cosim.mavlink.stubs import message
from tests.examples import examples

ACK, NAK, NOT_FOUND = 128, 129, 10


def send(station, packet):
    sent = message("FILE_TRANSFER_PROTOCOL", 1, target_network=0, payload=bytearray(packet).ljust(251, b"\0"))
    replies = [reply for reply in station.send(sent) if reply.get_type() == "FILE_TRANSFER_PROTOCOL"]
    return [(struct.unpack_from("<HBBBBBBI", raw), raw[12]) for raw in (bytes(reply.payload) for reply in replies)]


@pytest.mark.parametrize("session", [0, 7, 255])
@pytest.mark.parametrize(("opcode", "answer"), [(2, ACK), (1, ACK), (4, NAK), (3, NAK), (15, NAK), (99, NAK)])
def test_files_are_refused_in_the_session_that_the_station_chose(station, session, opcode, answer):
    """MAVProxy counts its sessions, and drops a reply of another one."""
    path = b"@PARAM/param.pck"
    packet = FTP_OP(0xFFFF, session, opcode, len(path), 0, 0, 0, bytearray(path)).pack()
    (((seq, of, kind, size, asked, *_), data),) = send(station, packet)
    assert (seq, of, kind, asked) == (0, session, answer, opcode)
    assert (size, data) == ((1, NOT_FOUND) if answer == NAK else (0, 0))


any_station = cache(Station)


@settings(max_examples=examples(200), deadline=None)
@given(st.binary(max_size=251))
def test_any_payload_is_answered_at_most_once(payload):
    assert len(send(any_station(), payload)) == (payload.ljust(4, b"\0")[3] not in (ACK, NAK))
