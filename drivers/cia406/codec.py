"""CAN frames of an encoder to values, without I/O: mapped PDOs, emergencies, heartbeats; counts to a continuous angle.

First the objects of CiA 301 and CiA 406 that the driver uses, by their place in the dictionary.
"""

import math
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
    """What a heartbeat reports (CiA 301, 7.2.8.3)."""

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
        self._at, self._mask, self._least_bytes = at, (1 << bits) - 1, -(-(at + bits) // 8)

    def read(self, data: bytes | bytearray) -> int | None:
        """Its unsigned value; None when the frame is shorter than its mapping states."""
        if len(data) < self._least_bytes:
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


SPEED_LIMIT_RAD_S = (
    100.0  # 16 turns a second: no arm joint turns so fast, even in an emulation run at ten times the pace
)
READINGS_OF_A_SLIP = 3  # a glitch on the line or in the disc is gone with the next reading
SLIPS_KEPT = 256
NEVER_AGAIN = 1 << 66  # units: a range beyond any number of 64 bits, so that no step reaches half of it
TIME_SCATTER_S = 0.002  # host times of SYNCs against the latching; measured: below 1 ms, busy host 2 ms


@dataclass(frozen=True)
class Scale:
    """What the encoder states of its counts."""

    units_per_turn: float  # of CiA 406 a whole number
    range_units: float  # the position begins again after so many; inf: it never does
    rises_counter_clockwise: bool
    offset_units: float = 0.0  # angle = (position + offset_units) * unit_rad
    first_near_zero: bool = True  # the first angle lies within half the range of zero; else it is as the position reads

    @property
    def unit_rad(self) -> float:
        """Angle of one count, counter-clockwise positive."""
        return math.copysign(math.tau / self.units_per_turn, 1.0 if self.rises_counter_clockwise else -1.0)


def scale_of(operating: int, units_per_turn: int, range_units: int, resolution: int, turns: int) -> Scale:
    """Scale from 6000h, 6001h, 6002h, 6501h, 6502h. ValueError for a scale that cannot be."""
    scaled = bool(operating & Operating.SCALING)
    units = units_per_turn if scaled else resolution
    total = range_units if scaled else resolution * turns
    if units < 1 or total < units:
        raise ValueError(f"{units} units a turn and a range of {total} units")
    return Scale(units, total, bool(operating & Operating.COUNTER_CLOCKWISE))


@dataclass(frozen=True)
class Slip:
    """The position moved without motion, and stayed: a coupling that slipped, a preset, a turn lost."""

    time_s: float
    size_rad: float


# A position made continuous in units, its time in s, and how fast it was moving then, in units a second (NaN: not known
# yet). No class: thousands a second are made of these.
_Reading = tuple[float, float, float]


class ContinuousAngle:
    """Unwraps one encoder's position. The offset counts before the first reading is brought near zero.

    Step = ((new - old + R/2) mod R) - R/2, R the range in units. A step is motion when it is no faster than the speed
    limit (over j at least: a busy host takes in one go what came one after the other) and, where an acceleration limit
    is given, no farther from the last speed v than a dt^2 + 2 |v| j allows, j the scatter of the host's times. Any
    other is NaN. When READINGS_OF_A_SLIP of them in a row agree with each other the position has slipped: it is
    reported from there on, and the slip is kept.
    """

    def __init__(
        self,
        scale: Scale,
        speed_limit_rad_s: float = SPEED_LIMIT_RAD_S,
        acceleration_limit_rad_s2: float = math.inf,
    ) -> None:
        self.jumps = 0
        self.wraps = 0
        self.slips: tuple[Slip, ...] = ()
        self.slip_rad = 0.0  # all slips together
        self._range = NEVER_AGAIN if math.isinf(scale.range_units) else scale.range_units
        self._half = self._range // 2
        self._offset, self._first_near_zero = scale.offset_units, scale.first_near_zero
        self._unit_rad, self._size_rad = scale.unit_rad, abs(scale.unit_rad)
        self._speed_limit_rad_s = speed_limit_rad_s
        self._acceleration_limit_rad_s2 = acceleration_limit_rad_s2
        self._last: _Reading | None = None
        self._uncertain: list[_Reading] = []

    def follow(self, position: int, time_s: float) -> float:
        """Angle in rad for a position read at `time_s`, or NaN."""
        last = self._last
        if last is None:
            units: float = position
            if self._first_near_zero:
                units -= int((position + self._offset + self._half) // self._range) * self._range
            self._last = units, time_s, math.nan
            return (units + self._offset) * self._unit_rad
        if self._uncertain:
            before = self._uncertain[-1]
            reading, is_motion = self._next(before, position, time_s)
            if is_motion:
                return self._hold_back(reading, last)
            self._uncertain.clear()
        reading, is_motion = self._next(last, position, time_s)
        if is_motion:
            return self._accept(reading)
        return self._hold_back((reading[0], time_s, last[2]), last)

    def _hold_back(self, reading: _Reading, last: _Reading) -> float:
        """NaN, or the angle after a slip when enough readings agree."""
        self.jumps += 1
        self._uncertain.append(reading)
        if len(self._uncertain) < READINGS_OF_A_SLIP:
            return math.nan
        return self._slipped(last, self._uncertain[0], reading)

    def _slipped(self, last: _Reading, first: _Reading, reading: _Reading) -> float:
        (units, last_s, rate), (units_then, first_s, _) = last, first
        unmoved = units + (0.0 if math.isnan(rate) else rate) * (first_s - last_s)
        slip = Slip(first_s, (units_then - unmoved) * self._unit_rad)
        self.slips = (*self.slips, slip)[-SLIPS_KEPT:]
        self.slip_rad += slip.size_rad
        return self._accept(reading)

    def _accept(self, reading: _Reading) -> float:
        last, units = self._last, reading[0]
        if last is not None and self._range < NEVER_AGAIN:
            self.wraps += int(abs(units // self._range - last[0] // self._range))
        self._last = reading
        self._uncertain.clear()
        return (units + self._offset) * self._unit_rad

    def _next(self, before: _Reading, position: int, time_s: float) -> tuple[_Reading, bool]:
        """The reading after another, and whether the step to it is motion. Every frame comes here: no further calls."""
        units, before_s, rate = before
        step = (position - units + self._half) % self._range - self._half
        elapsed_s = time_s - before_s
        reading = units + step, time_s, step / elapsed_s if elapsed_s > 0.0 else rate
        unit_rad = self._size_rad
        limit_s = elapsed_s if elapsed_s > TIME_SCATTER_S else TIME_SCATTER_S
        if abs(step) * unit_rad > self._speed_limit_rad_s * limit_s + unit_rad:
            return reading, False
        if self._acceleration_limit_rad_s2 == math.inf or math.isnan(rate):
            return reading, True
        off_rad = abs(step - rate * elapsed_s) * unit_rad
        scatter_rad = 2.0 * abs(rate) * unit_rad * TIME_SCATTER_S
        return reading, off_rad <= self._acceleration_limit_rad_s2 * elapsed_s**2 + scatter_rad + 2.0 * unit_rad
