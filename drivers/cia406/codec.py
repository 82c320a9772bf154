"""CAN frames of an encoder to values, without I/O: mapped PDOs, emergencies, heartbeats.

First the objects of CiA 301 and CiA 406 that the driver uses, by their place in the dictionary.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum, IntFlag

DEVICE_TYPE = 0x1000
ERROR_REGISTER = 0x1001
STORE = 0x1010
HEARTBEAT_MS = 0x1017
IDENTITY = 0x1018
TPDO2_COMMUNICATION, TPDO2_MAPPING = 0x1801, 0x1A01
OPERATING_PARAMETERS = 0x6000
UNITS_PER_TURN, RANGE_UNITS = 0x6001, 0x6002
PRESET = 0x6003
POSITION = 0x6004
TURN_RESOLUTION, TURNS = 0x6501, 0x6502

PROFILE = 0x0196  # low word of 1000h: 406, encoders
PDO_INVALID = 1 << 31
SAVE = int.from_bytes(b"save", "little")  # 1010h:01
EVERY_SYNC = 1  # transmission type
EMERGENCY_ID, HEARTBEAT_ID, SYNC_ID = 0x080, 0x700, 0x080


class Operating(IntFlag):
    """Bits of 6000h."""

    COUNTER_CLOCKWISE = 0x0001  # position rises with counter-clockwise turning; else with clockwise
    SCALING = 0x0004  # 6001h and 6002h are in force


class NmtState(IntEnum):
    """What a heartbeat says (CiA 301, 7.2.8.3)."""

    BOOT_UP = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F


EMERGENCY_TEXTS = {  # CiA 301 table 26 and encoder manuals (Baumer, SICK, POSITAL)
    0x0000: "no error any more",
    0x1000: "generic error",
    0x4200: "temperature",
    0x5010: "sensor error",
    0x5020: "sensor error",
    0x5530: "EEPROM",
    0x6010: "software reset by watchdog",
    0x7320: "position error",
    0x7510: "internal communication",
    0x8110: "CAN overrun",
    0x8120: "CAN error passive",
    0x8130: "heartbeat or life guard missing",
    0x8140: "recovered from bus off",
    0x8210: "PDO not processed, length",
    0x8220: "PDO too long",
    0xFF00: "vendor specific, often battery low",
}


@dataclass(frozen=True)
class MappedObject:
    """One entry of 1Axxh."""

    index: int
    subindex: int
    bits: int


@dataclass(frozen=True)
class Emergency:
    """An EMCY message."""

    host_s: float
    node: int
    code: int
    error_register: int
    vendor: bytes  # 5 bytes; many encoders put 6503h in the first two and 6505h in the next two

    def __str__(self) -> str:
        text = EMERGENCY_TEXTS.get(self.code, "unknown to this program")
        return f"encoder {self.node}: emergency {self.code:04X}h, {text}, error register {self.error_register:02X}h"


def mapped_object(word: int) -> MappedObject:
    """A mapping entry index << 16 | subindex << 8 | bits (CiA 301, 7.5.2.36)."""
    return MappedObject(word >> 16, word >> 8 & 0xFF, word & 0xFF)


class MappedNumber:
    """Where an object stands in a PDO: `bits` from bit `at` on, counted from the lowest of the first byte."""

    def __init__(self, at: int, bits: int) -> None:
        self._at, self._mask, self._least_bits = at, (1 << bits) - 1, at + bits

    def read(self, data: bytes | bytearray) -> int | None:
        """Its unsigned value; None when the frame is shorter than its mapping says."""
        if 8 * len(data) < self._least_bits:
            return None
        return int.from_bytes(data, "little") >> self._at & self._mask


def mapped_number(mapping: Sequence[MappedObject], index: int) -> MappedNumber | None:
    """Object `index` of a PDO; None when it is not mapped."""
    at = 0
    for entry in mapping:
        if entry.index == index:
            return MappedNumber(at, entry.bits)
        at += entry.bits
    return None


def emergency(host_s: float, node: int, data: bytes) -> Emergency | None:
    """None when the frame is not one of 8 bytes (CiA 301, 7.2.7.1)."""
    if len(data) != 8:
        return None
    code, register = struct.unpack_from("<HB", data)
    return Emergency(host_s, node, code, register, data[3:])


def heartbeat_state(data: bytes) -> NmtState | None:
    """None when it is no heartbeat; bit 7 is the toggle of node guarding and does not count."""
    if len(data) != 1:
        return None
    known = {state.value: state for state in NmtState}
    return known.get(data[0] & 0x7F, known.get(data[0]))
