"""What a Modbus server answers to a request, whatever line it came over.

Does not imitate: coils and discrete inputs (exception 1), diagnostics, file records, mask write, FIFO.
Source: Modbus Application Protocol Specification V1.1b3, sections 6 and 7.

Modbus RTU: one serial line with one server on it.

A request whose checksum is wrong, or that is for another unit, is not answered. Does not imitate: baud rate and parity,
the silence of 3.5 characters that ends a frame (its length is known from its function code; what does not become whole
within a tick or two is dropped), other servers on the line.
Source: Modbus over Serial Line Specification V1.02, sections 2.5.1 and 6.2.2 (CRC).

Modbus TCP: one client's connection. Every unit number is answered, as UR controllers and most PLCs do.

Source: Modbus Messaging on TCP/IP Implementation Guide V1.0b, section 3.1.3 (MBAP header).
"""

import struct
from collections.abc import Callable
from enum import IntEnum

from simulators.modbus.register_map import HOLDING, INPUT, RegisterMemory

MOST_READ, MOST_WRITTEN = 125, 123


class Function(IntEnum):
    """Function codes that are served."""

    READ_HOLDING = 3
    READ_INPUT = 4
    WRITE_ONE = 6
    WRITE_MANY = 16


class ModbusRefusal(IntEnum):
    """Exception codes."""

    ILLEGAL_FUNCTION = 1
    ILLEGAL_ADDRESS = 2
    ILLEGAL_VALUE = 3
    DEVICE_FAILURE = 4


def answer(request: bytes, memory: RegisterMemory) -> bytes:
    """The response PDU to a request PDU of at least one byte; both begin with the function code."""
    try:
        match request[0]:
            case Function.READ_HOLDING:
                return _read(request, memory, HOLDING)
            case Function.READ_INPUT:
                return _read(request, memory, INPUT)
            case Function.WRITE_ONE:
                return _write_one(request, memory)
            case Function.WRITE_MANY:
                return _write_many(request, memory)
            case _:
                return refused(request, ModbusRefusal.ILLEGAL_FUNCTION)
    except struct.error:
        return refused(request, ModbusRefusal.ILLEGAL_VALUE)


def refused(request: bytes, code: ModbusRefusal) -> bytes:
    """An exception response."""
    return bytes((request[0] | 0x80, code))


def _read(request: bytes, memory: RegisterMemory, table: str) -> bytes:
    address, count = struct.unpack(">HH", request[1:])
    if not 1 <= count <= MOST_READ:
        return refused(request, ModbusRefusal.ILLEGAL_VALUE)
    words = memory.get(table, address, count)
    if words is None:
        return refused(request, ModbusRefusal.ILLEGAL_ADDRESS)
    return struct.pack(f">BB{count}H", request[0], 2 * count, *words)


def _write_one(request: bytes, memory: RegisterMemory) -> bytes:
    address, word = struct.unpack(">HH", request[1:])
    return request if memory.write(address, [word]) else refused(request, ModbusRefusal.ILLEGAL_ADDRESS)


def _write_many(request: bytes, memory: RegisterMemory) -> bytes:
    address, count, size = struct.unpack_from(">HHB", request, 1)
    if not 1 <= count <= MOST_WRITTEN or size != 2 * count:
        return refused(request, ModbusRefusal.ILLEGAL_VALUE)
    words = struct.unpack(f">{count}H", request[6:])
    return request[:5] if memory.write(address, words) else refused(request, ModbusRefusal.ILLEGAL_ADDRESS)


SHORTEST = 8  # unit, function, two words, checksum: also the length of all requests but one
PATIENCE_TICKS = 25  # 50 ms: a frame of 256 bytes at 115200 baud takes 22 ms


class RtuWire:
    """Bytes in, bytes out."""

    def __init__(self, memory: RegisterMemory, unit: int, silent: Callable[[], bool]) -> None:
        self._memory, self._unit, self._silent = memory, unit, silent
        self._pending = b""
        self._waited = 0

    def handle(self, data: bytes) -> bytes:
        self._pending += data
        self._waited = 0
        out = bytearray()
        while (request := self._next()) is not None:
            if request[0] == self._unit and not self._silent():
                out += _rtu_framed(self._unit, answer(request[1:], self._memory))
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
        return _rtu_framed(self._unit, refused(request[1:], ModbusRefusal.DEVICE_FAILURE))

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


def _rtu_framed(unit: int, pdu: bytes) -> bytes:
    content = bytes((unit,)) + pdu
    return content + checksum(content).to_bytes(2, "little")


MBAP = struct.Struct(">HHHB")  # transaction, protocol 0, length of what follows it, unit
LONGEST_PDU = 253


class TcpWire:
    """Requests may be pipelined. What is no Modbus ends the connection."""

    def __init__(self, memory: RegisterMemory, silent: Callable[[], bool]) -> None:
        self._memory, self._silent = memory, silent
        self._pending = b""
        self.closing = False

    def handle(self, data: bytes) -> bytes:
        self._pending += data
        out = bytearray()
        while not self.closing and (request := self._next()) is not None:
            head, pdu = request
            if not self._silent():
                out += _tcp_framed(head, answer(pdu, self._memory))
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
        return _tcp_framed(request[: MBAP.size], refused(request[MBAP.size :], ModbusRefusal.DEVICE_FAILURE))

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


def _tcp_framed(head: bytes, pdu: bytes) -> bytes:
    transaction, protocol, _, unit = MBAP.unpack(head)
    return MBAP.pack(transaction, protocol, len(pdu) + 1, unit) + pdu
