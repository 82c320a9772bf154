"""CAN frames of an encoder to values, without I/O: mapped PDOs, emergencies, heartbeats."""

import struct
from collections.abc import Sequence
from dataclasses import dataclass

from drivers.cia406.objects import EMERGENCY_TEXTS, NmtState


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
