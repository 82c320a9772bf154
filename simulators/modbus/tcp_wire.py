"""Modbus TCP: one client's connection. Every unit number is answered, as UR controllers and most PLCs do.

Source: Modbus Messaging on TCP/IP Implementation Guide V1.0b, section 3.1.3 (MBAP header).
"""

import struct
from collections.abc import Callable

from simulators.modbus.memory import Memory
from simulators.modbus.server import Refusal, answer, refused

MBAP = struct.Struct(">HHHB")  # transaction, protocol 0, length of what follows it, unit
LONGEST_PDU = 253


class TcpWire:
    """Requests may be pipelined. What is no Modbus ends the connection."""

    def __init__(self, memory: Memory, silent: Callable[[], bool]) -> None:
        self._memory, self._silent = memory, silent
        self._pending = b""
        self.closing = False

    def handle(self, data: bytes) -> bytes:
        self._pending += data
        out = bytearray()
        while not self.closing and (request := self._next()) is not None:
            head, pdu = request
            if not self._silent():
                out += _framed(head, answer(pdu, self._memory))
        return bytes(out)

    def due(self) -> bytes:
        return b""

    def damaged(self, output: bytes) -> bytes:
        """For injected faults: a protocol number that is not Modbus; there is no checksum."""
        return output[:2] + b"\x5a\x5a" + output[4:]

    def refusal(self, request: bytes) -> bytes | None:
        """For injected faults: device failure."""
        if len(request) <= MBAP.size:
            return None
        return _framed(request[: MBAP.size], refused(request[MBAP.size :], Refusal.DEVICE_FAILURE))

    def _next(self) -> tuple[bytes, bytes] | None:
        """Header and PDU of the next whole request; None while there is none."""
        if len(self._pending) < MBAP.size:
            return None
        _, protocol, length, _ = MBAP.unpack_from(self._pending)
        if protocol != 0 or not 2 <= length <= LONGEST_PDU + 1:
            self.closing = True
            return None
        end = MBAP.size - 1 + length
        if len(self._pending) < end:
            return None
        head, pdu, self._pending = self._pending[: MBAP.size], self._pending[MBAP.size : end], self._pending[end:]
        return head, pdu


def _framed(head: bytes, pdu: bytes) -> bytes:
    transaction, protocol, _, unit = MBAP.unpack(head)
    return MBAP.pack(transaction, protocol, len(pdu) + 1, unit) + pdu
