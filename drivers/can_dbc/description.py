"""What a DBC file states of encoders: which frame carries which joint, and what one count is.

cantools reads the file and takes frames apart; what it raises becomes DeviceRefused here, with the cause kept.
"""

import enum
import logging
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cantools
from cantools.database.can import Database, Message, Signal

from drivers.cia406.codec import Scale
from drivers.errors import DeviceRefused

log = logging.getLogger(__name__)
SHOWN = 120  # characters of what a file holds, in an error
FLOAT_STEPS = 1 << 40  # counts in 1.0 of a floating-point signal: finer than what 32 bits resolve of one turn
MANTISSA_BITS = {16: 10, 32: 23, 64: 52}  # IEEE 754
MOST_RAD = 1e5  # 16,000 turns: an encoder on the motor, over the whole travel of an axis with a gear
ROUNDED = 1e-3  # of the span of a stated range: an end of 3.14 or 3.1416 is half a turn
CHANCE = 0.01  # of a turn
UNITS_RAD = {
    "rad": 1.0,
    "mrad": 1e-3,
    "deg": math.pi / 180.0,
    "°": math.pi / 180.0,
    "degree": math.pi / 180.0,
    "degrees": math.pi / 180.0,
    "turn": math.tau,
    "turns": math.tau,
    "rev": math.tau,
}


class NoReading(enum.Enum):
    """Why a row has no angle of an encoder; the values are those of the channel `no_reading`, where 0 is a reading."""

    NO_ANSWER = 1  # nothing came from it for this row
    OUT_OF_RANGE = 2  # beyond the range that the signal states, or no finite number
    TOO_FAST = 3  # the step to it is faster than a joint turns


@dataclass(frozen=True)
class JointSignal:
    """One joint's signal: `message` takes its frame apart; `source` is the DBC file.

    angle = (continuous counts + scale.offset_units) * scale.unit_rad. A floating-point signal has FLOAT_STEPS counts
    in 1.0.
    """

    name: str
    message: Message
    signal: Signal
    scale: Scale
    source: Path

    @property
    def frame(self) -> tuple[int, bool]:
        """Identifier, and whether it is an extended one."""
        return self.message.frame_id, self.message.is_extended_frame

    @property
    def resolution_rad(self) -> float:
        """One count; of a floating-point signal the last digit within a turn."""
        if self.signal.is_float:
            return math.tau * 2.0 ** -MANTISSA_BITS[self.signal.length]
        return abs(self.scale.unit_rad)

    def counts(self, data: bytes) -> int | NoReading | None:
        """The raw number in a frame; None when the frame does not fit, or carries other multiplexed signals."""
        try:
            found = self.message.decode(data, decode_choices=False, scaling=False)
        except Exception:  # cantools and bitstruct raise their own for every kind of misfit; none may end a stream
            return None
        raw = found.get(self.signal.name) if isinstance(found, dict) else None
        if not isinstance(raw, int | float):
            return None
        if not math.isfinite(raw) or not self._in_range(raw):
            return NoReading.OUT_OF_RANGE
        return round(raw * FLOAT_STEPS) if self.signal.is_float else int(raw)

    def _in_range(self, raw: float) -> bool:
        """Within the ends that the file states, by half a count, and within what an angle can be."""
        counts = raw * FLOAT_STEPS if self.signal.is_float else raw
        if abs((counts + self.scale.offset_units) * self.scale.unit_rad) > MOST_RAD:
            return False
        ends = _ends(self.signal)
        if ends is None:
            return True
        value = raw * float(self.signal.scale) + float(self.signal.offset)
        slack = ROUNDED * (ends[1] - ends[0]) + (0.0 if self.signal.is_float else 0.5 * abs(float(self.signal.scale)))
        return ends[0] - slack <= value <= ends[1] + slack


def joint_signals(path: Path, names: Sequence[str], units_per_turn: float | None) -> tuple[JointSignal, ...]:
    """Signals "Message.Signal" of a DBC file, in order. DeviceRefused naming what is there instead.

    A file with signals that overlap, or do not fit in their message, is read all the same; each such message is logged.
    """
    try:
        database = cantools.database.load_file(path, strict=False)
    except (OSError, ValueError, cantools.Error) as cause:
        why = str(cause)[:SHOWN]  # a parser's words repeat the whole line
        raise DeviceRefused(f"encoders: {path} cannot be read as a DBC file ({why}); export it again") from cause
    if not isinstance(database, Database):
        raise DeviceRefused(f"encoders: {path} describes no CAN bus, but diagnostics; name a DBC file")
    for fault in _layout_faults(database):
        log.warning("%s: %s It was read as it stands; correct the DBC file", path, fault)
    return tuple(_joint_signal(database, path, name, units_per_turn) for name in names)


def _layout_faults(database: Database) -> Iterator[str]:
    """What cantools' strict check finds wrong, of each message, which it names."""
    for message in database.messages:
        try:
            message.refresh(strict=True)
        except cantools.Error as fault:
            yield str(fault)[:SHOWN]


def _joint_signal(database: Database, path: Path, name: str, units_per_turn: float | None) -> JointSignal:
    known = {
        f"{message.name}.{signal.name}": (message, signal)
        for message in database.messages
        for signal in message.signals
    }
    if name not in known:
        there = ", ".join(sorted(known))[:SHOWN]
        raise DeviceRefused(f"encoders: no signal '{name[:SHOWN]}' in {path}; there are {there or 'none'}")
    message, signal = known[name]
    try:
        scale = _scale(signal, units_per_turn)
    except (ArithmeticError, ValueError) as cause:  # a factor of 0, a range without end
        raise DeviceRefused(f"encoders: {name} of {path}: {str(cause)[:SHOWN]}; correct the DBC file") from cause
    return JointSignal(name, message, signal, scale, path)


def _scale(signal: Signal, units_per_turn: float | None) -> Scale:
    """The unit of the signal gives the angle of a count; without one, `units_per_turn` of the rig file does."""
    unit_rad = UNITS_RAD.get((signal.unit or "").strip().lower())
    steps = FLOAT_STEPS if signal.is_float else 1
    factor, offset = float(signal.scale), float(signal.offset)
    if units_per_turn is not None:
        count_rad = math.tau / units_per_turn / steps
    elif unit_rad is not None:
        count_rad = abs(factor) * unit_rad / steps
    else:
        raise ValueError(f"unit {signal.unit or ''!r} is no angle; give units_per_turn in the rig file")
    if not 0.0 < count_rad < math.inf or not math.isfinite(offset):
        raise ValueError(f"one count is {count_rad} rad, with an offset of {offset:g}")
    units_per_turn = math.tau / count_rad
    range_units, is_circle = _range(signal, units_per_turn)
    return Scale(units_per_turn, range_units, factor > 0.0, offset / factor * steps, is_circle)


def _range(signal: Signal, units_per_turn: float) -> tuple[float, bool]:
    """Counts after which the signal begins again, inf where it never does; and whether they are whole turns.

    Stated ends are values that it takes, unless they are whole turns apart: then they are one place of the disc, so
    that "[0|360]" in degrees is what "[0|359.9]" with a count of 0.1 is. Ends that are no whole turns apart are no
    circle. Without stated ends a counter begins again after its bits, on whichever angle that is.
    """
    ends = _ends(signal)
    if ends is None:
        return (math.inf, False) if signal.is_float else _counter_range(signal, units_per_turn)
    counts = (ends[1] - ends[0]) / abs(float(signal.scale))
    for steps in (counts * FLOAT_STEPS,) if signal.is_float else (counts, counts + 1.0):
        turns = round(steps / units_per_turn)
        slack = ROUNDED * steps if signal.is_float else max(ROUNDED * steps, _slack(units_per_turn))
        if turns > 0 and abs(steps - turns * units_per_turn) < slack:
            return _whole(turns * units_per_turn), True
    return math.inf, False


def _counter_range(signal: Signal, units_per_turn: float) -> tuple[float, bool]:
    bits = 1 << signal.length
    turns = round(bits / units_per_turn)
    return bits, turns > 0 and abs(bits - turns * units_per_turn) < _slack(units_per_turn)


def _slack(units_per_turn: float) -> float:
    """Counts by which whole turns may be missed: the ends are counts, and few counts a turn would hit by chance."""
    return min(0.5, CHANCE * units_per_turn)


def _whole(units: float) -> float:
    """As int where it is one, so that positions stay exact; the turn in rad is none."""
    return round(units) if abs(units - round(units)) < 1e-6 else units


def _ends(signal: Signal) -> tuple[float, float] | None:
    """The ends of the stated range in the signal's unit; None where it states none ("[0|0]")."""
    if signal.minimum is None or signal.maximum is None or signal.maximum <= signal.minimum:
        return None
    return float(signal.minimum), float(signal.maximum)
