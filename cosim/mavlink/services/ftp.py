"""File transfer: a read-only server of one file, the packed parameters, without access to the file system."""

from __future__ import annotations

import re
import struct
from collections import OrderedDict
from typing import Any, NamedTuple

from cosim.mavlink.services.packed_parameters import compute_crc32, pack_parameters
from cosim.mavlink.services.parameter_protocol import ParameterProtocol
from cosim.mavlink.services.service import Service
from cosim.mavlink.vehicle.vehicle_context import Sender, VehicleContext

_HEADER = struct.Struct("<HBBBBBBI")  # seq, session, opcode, size, req_opcode, burst_complete, padding, offset
_MAX_DATA = 239  # bytes in a payload
_PAYLOAD = 251
_FOLDER, _FILE = "@PARAM", "param.pck"
_MAX_CLIENTS = 8  # with an open file, one each; a further client replaces the one unused for longest
_BURST = 16  # packets
_MAX_PATH = 100

_BURST_READ = 15
_WRITING = (6, 7, 8, 9, 10, 11, 12, 13)  # create, write, remove, make and remove folders, open, truncate, rename
_ACK, _NAK = 128, 129
_INVALID_SIZE, _INVALID_SESSION, _EOF, _UNKNOWN, _PROTECTED, _NOT_FOUND = 3, 4, 6, 7, 9, 10


class _Request(NamedTuple):
    """A decoded request of a client: link, system and component."""

    client: tuple[str, int, int]
    seq: int
    session: int
    opcode: int
    size: int
    offset: int
    data: bytes


class FtpError(Exception):
    """Raised for a refused request; `code` is its MAV_FTP_ERR."""

    def __init__(self, error: int) -> None:
        super().__init__(error)
        self.code = error


class FileServer(Service):
    """FILE_TRANSFER_PROTOCOL."""

    def __init__(self, context: VehicleContext, parameters: ParameterProtocol) -> None:
        super().__init__(context)
        self._parameters = parameters
        self._opened: OrderedDict[tuple[str, int, int], tuple[int, bytes]] = OrderedDict()  # session, content by client

    def _receive_file_transfer_protocol(self, sender: Sender, message: Any) -> None:
        raw = bytes(message.payload[:_PAYLOAD]).ljust(_PAYLOAD, b"\0")
        seq, session, opcode, size, _, _, _, offset = _HEADER.unpack_from(raw)
        if opcode in (_ACK, _NAK):
            return
        client = sender.link.name, sender.system, sender.component
        request = _Request(client, seq, session, opcode, size, offset, raw[_HEADER.size : _HEADER.size + size])
        replies = self._replies(request)
        self.reply(sender, [self.context.make("FILE_TRANSFER_PROTOCOL", 0, *sender.address, data) for data in replies])

    def _replies(self, request: _Request) -> list[bytes]:
        is_burst = request.opcode == _BURST_READ
        try:
            parts = self._burst(request) if is_burst else [(request.offset, self._answer(request))]
        except FtpError as error:
            return [_packet(request, 1, _NAK, bytes([error.code]), request.offset)]
        last = len(parts) if is_burst else 0
        return [_packet(request, i, _ACK, data, offset, i == last) for i, (offset, data) in enumerate(parts, 1)]

    def _answer(self, request: _Request) -> bytes:
        match request.opcode:
            case 0:  # no operation
                return b""
            case 1 | 2:  # the end of a session, or of all
                self._opened.pop(request.client, None)
                return b""
            case 3:  # list a folder
                return self._listing(_path(request), request.offset)
            case 4:  # open for reading
                return self._open(request)
            case 5:  # read
                return _read_part(self._content_of(request), request.offset, request.size)
            case 14:  # CRC-32 of a file
                return struct.pack("<I", compute_crc32(self._content(_path(request))))
        raise FtpError(_PROTECTED if request.opcode in _WRITING else _UNKNOWN)

    def _open(self, request: _Request) -> bytes:
        content = self._content(_path(request))
        self._opened[request.client] = request.session, content
        self._opened.move_to_end(request.client)
        if len(self._opened) > _MAX_CLIENTS:
            self._opened.popitem(last=False)
        return struct.pack("<I", len(content))

    def _content_of(self, request: _Request) -> bytes:
        """Return the content of the file that a client has opened."""
        session, content = self._opened.get(request.client, (None, b""))
        if session != request.session:
            raise FtpError(_INVALID_SESSION)
        self._opened.move_to_end(request.client)
        return content

    def _burst(self, request: _Request) -> list[tuple[int, bytes]]:
        """Return the parts of a burst, each with its offset."""
        content, offset = self._content_of(request), request.offset
        parts = [(offset, _read_part(content, offset, request.size))]
        while len(parts) < _BURST and (offset := offset + len(parts[-1][1])) < len(content):
            parts.append((offset, _read_part(content, offset, request.size)))
        return parts

    # ---- files ----

    def _content(self, path: str) -> bytes:
        name, _, query = path.lstrip("/").partition("?")
        if name != f"{_FOLDER}/{_FILE}":
            raise FtpError(_NOT_FOUND)
        parameters = self._parameters.list_values()
        start, count = _number(query, "start", 0), _number(query, "count", len(parameters))
        return pack_parameters(parameters[start : start + count], len(parameters))

    def _listing(self, path: str, offset: int) -> bytes:
        folder = path.strip("/")
        if folder == "":
            entries = [f"D{_FOLDER}"]
        elif folder == _FOLDER:
            entries = [f"F{_FILE}\t{len(self._content(f'{_FOLDER}/{_FILE}'))}"]
        else:
            raise FtpError(_NOT_FOUND)
        if offset >= len(entries):
            raise FtpError(_EOF)
        return b"".join(entry.encode() + b"\0" for entry in entries[offset:])


def _path(request: _Request) -> str:
    path = request.data.split(b"\0", 1)[0]
    if len(path) > _MAX_PATH:
        raise FtpError(_NOT_FOUND)
    return path.decode("ascii", "replace")


def _number(query: str, key: str, default: int) -> int:
    match = re.search(rf"(?:^|[?&]){key}=([0-9]{{1,5}})(?:&|$)", query)
    return int(match[1]) if match else default


def _read_part(content: bytes, offset: int, size: int) -> bytes:
    if size > _MAX_DATA:
        raise FtpError(_INVALID_SIZE)
    if offset >= len(content):
        raise FtpError(_EOF)
    return content[offset : offset + (size or _MAX_DATA)]


def _packet(request: _Request, after: int, opcode: int, data: bytes, offset: int, complete: bool = False) -> bytes:
    """Return a reply; it echoes the session of the request, by which a station recognizes it."""
    seq = (request.seq + after) & 0xFFFF
    header = _HEADER.pack(seq, request.session, opcode, len(data), request.opcode, complete, 0, offset)
    return (header + data).ljust(_PAYLOAD, b"\0")
