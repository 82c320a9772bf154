"""What a Modbus server answers to a request, whatever line it came over.

Does not imitate: coils and discrete inputs (exception 1), diagnostics, file records, mask write, FIFO.
Source: Modbus Application Protocol Specification V1.1b3, sections 6 and 7.
"""

import struct
from enum import IntEnum

from simulators.modbus.memory import HOLDING, INPUT, Memory

MOST_READ, MOST_WRITTEN = 125, 123


class Function(IntEnum):
    """Function codes that are served."""

    READ_HOLDING = 3
    READ_INPUT = 4
    WRITE_ONE = 6
    WRITE_MANY = 16


class Refusal(IntEnum):
    """Exception codes."""

    ILLEGAL_FUNCTION = 1
    ILLEGAL_ADDRESS = 2
    ILLEGAL_VALUE = 3
    DEVICE_FAILURE = 4


def answer(request: bytes, memory: Memory) -> bytes:
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
                return refused(request, Refusal.ILLEGAL_FUNCTION)
    except struct.error:
        return refused(request, Refusal.ILLEGAL_VALUE)


def refused(request: bytes, code: Refusal) -> bytes:
    """An exception response."""
    return bytes((request[0] | 0x80, code))


def _read(request: bytes, memory: Memory, table: str) -> bytes:
    address, count = struct.unpack(">HH", request[1:])
    if not 1 <= count <= MOST_READ:
        return refused(request, Refusal.ILLEGAL_VALUE)
    words = memory.get(table, address, count)
    if words is None:
        return refused(request, Refusal.ILLEGAL_ADDRESS)
    return struct.pack(f">BB{count}H", request[0], 2 * count, *words)


def _write_one(request: bytes, memory: Memory) -> bytes:
    address, word = struct.unpack(">HH", request[1:])
    return request if memory.write(address, [word]) else refused(request, Refusal.ILLEGAL_ADDRESS)


def _write_many(request: bytes, memory: Memory) -> bytes:
    address, count, size = struct.unpack_from(">HHB", request, 1)
    if not 1 <= count <= MOST_WRITTEN or size != 2 * count:
        return refused(request, Refusal.ILLEGAL_VALUE)
    words = struct.unpack(f">{count}H", request[6:])
    return request[:5] if memory.write(address, words) else refused(request, Refusal.ILLEGAL_ADDRESS)
