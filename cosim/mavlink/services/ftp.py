"""File transfer: no file is served; a station that is refused its parameter file requests the list at once."""

from __future__ import annotations

import struct
from typing import Any

from cosim.mavlink.services.service import Service
from cosim.mavlink.vehicle.vehicle_context import Sender

_HEADER = struct.Struct("<HBBBBBBI")  # seq, session, opcode, size, req_opcode, burst_complete, padding, offset
_PAYLOAD = 251  # bytes
_ENDS = (0, 1, 2)  # opcodes of no operation, and of the end of one session and of all
_ACK, _NAK, _NOT_FOUND = 128, 129, bytes([10])


class FileTransfer(Service):
    """FILE_TRANSFER_PROTOCOL."""

    def _receive_file_transfer_protocol(self, sender: Sender, message: Any) -> None:
        raw = bytes(message.payload[:_PAYLOAD]).ljust(_PAYLOAD, b"\0")
        seq, session, opcode, *_ = _HEADER.unpack_from(raw)
        if opcode in (_ACK, _NAK):
            return
        answer, data = (_ACK, b"") if opcode in _ENDS else (_NAK, _NOT_FOUND)
        header = _HEADER.pack((seq + 1) & 0xFFFF, session, answer, len(data), opcode, 0, 0, 0)
        payload = (header + data).ljust(_PAYLOAD, b"\0")
        self.reply(sender, [self.context.make("FILE_TRANSFER_PROTOCOL", 0, *sender.address, payload)])
