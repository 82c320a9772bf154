"""Modbus RTU: one serial line with one server on it.

A request whose checksum is wrong, or that is for another unit, is not answered. Does not imitate: baud rate and parity,
the silence of 3.5 characters that ends a frame (its length is known from its function code; what does not become whole
within a tick or two is dropped), other servers on the line.
Source: Modbus over Serial Line Specification V1.02, sections 2.5.1 and 6.2.2 (CRC).
"""

from collections.abc import Callable

from simulators.modbus.memory import Memory
from simulators.modbus.server import Function, Refusal, answer, refused

SHORTEST = 8  # unit, function, two words, checksum: also the length of all requests but one
PATIENCE_TICKS = 25  # 50 ms: a frame of 256 bytes at 115200 baud takes 22 ms


class RtuWire:
    """Bytes in, bytes out."""

    def __init__(self, memory: Memory, unit: int, silent: Callable[[], bool]) -> None:
        self._memory, self._unit, self._silent = memory, unit, silent
        self._pending = b""
        self._waited = 0

    def handle(self, data: bytes) -> bytes:
        self._pending += data
        self._waited = 0
        out = bytearray()
        while (request := self._next()) is not None:
            if request[0] == self._unit and not self._silent():
                out += _framed(self._unit, answer(request[1:], self._memory))
        return bytes(out)

    def due(self) -> bytes:
        self._waited += 1
        if self._waited > PATIENCE_TICKS:
            self._pending = b""
        return b""

    def refusal(self, request: bytes) -> bytes | None:
        """For injected faults: device failure."""
        if len(request) < SHORTEST or request[0] != self._unit:
            return None
        return _framed(self._unit, refused(request[1:], Refusal.DEVICE_FAILURE))

    def _next(self) -> bytes | None:
        """The next whole request without its checksum; bytes before it that are none are dropped."""
        while len(self._pending) >= SHORTEST:
            size = _size(self._pending)
            if len(self._pending) < size:
                return None
            frame = self._pending[:size]
            if checksum(frame[:-2]) == int.from_bytes(frame[-2:], "little"):
                self._pending = self._pending[size:]
                return frame[:-2]
            self._pending = self._pending[1:]
        return None


def checksum(content: bytes) -> int:
    """CRC-16 of the specification: polynomial 0xA001 reflected, start at all ones."""
    crc = 0xFFFF
    for byte in content:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ 0xA001 if crc & 1 else crc >> 1
    return crc


def _size(frame: bytes) -> int:
    """How long the request that begins here must be."""
    return 9 + frame[6] if frame[1] == Function.WRITE_MANY else SHORTEST


def _framed(unit: int, pdu: bytes) -> bytes:
    content = bytes((unit,)) + pdu
    return content + checksum(content).to_bytes(2, "little")
