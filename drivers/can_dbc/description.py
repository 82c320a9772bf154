"""What a DBC file states of encoders: which frame carries which joint, and what one count is.

cantools reads the file and takes frames apart; what it raises becomes DeviceRefused here, with the cause kept.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cantools
from cantools.database.can import Database, Message, Signal

from drivers.cia406.codec import Scale
from drivers.errors import DeviceRefused

SHOWN = 120  # characters of what a file holds, in an error
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


@dataclass(frozen=True)
class JointSignal:
    """One joint's signal: `message` takes its frame apart; angle = continuous counts * scale.unit_rad + offset_rad."""

    name: str
    message: Message
    signal: str
    scale: Scale
    offset_rad: float

    @property
    def frame(self) -> tuple[int, bool]:
        """Identifier, and whether it is an extended one."""
        return self.message.frame_id, self.message.is_extended_frame

    def counts(self, data: bytes) -> int | None:
        """The raw number in a frame; None when the frame does not fit, or carries other multiplexed signals."""
        try:
            found = self.message.decode(data, decode_choices=False, scaling=False)
        except Exception:  # cantools and bitstruct raise their own for every kind of misfit; none may end a stream
            return None
        raw = found.get(self.signal) if isinstance(found, dict) else None
        return int(raw) if isinstance(raw, int) else None


def joint_signals(path: Path, names: Sequence[str], units_per_turn: float | None) -> tuple[JointSignal, ...]:
    """Signals "Message.Signal" of a DBC file, in order. DeviceRefused naming what is there instead."""
    try:
        database = cantools.database.load_file(path)
    except (OSError, ValueError, cantools.Error) as cause:
        why = str(cause)[:SHOWN]  # a parser's words repeat the whole line
        raise DeviceRefused(f"encoders: {path} cannot be read as a DBC file ({why}); export it again") from cause
    if not isinstance(database, Database):
        raise DeviceRefused(f"encoders: {path} describes no CAN bus, but diagnostics; name a DBC file")
    return tuple(_joint_signal(database, path, name, units_per_turn) for name in names)


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
    if signal.is_float:
        raise DeviceRefused(f"encoders: {name} of {path} is a floating-point signal; encoders count")
    try:
        scale = _scale(signal, units_per_turn)
        offset_rad = float(signal.offset) / float(signal.scale) * scale.unit_rad
    except (ArithmeticError, ValueError) as cause:  # a factor of 0, a range without end
        raise DeviceRefused(f"encoders: {name} of {path}: {str(cause)[:SHOWN]}; correct the DBC file") from cause
    return JointSignal(name, message, signal.name, scale, offset_rad)


def _scale(signal: Signal, units_per_turn: float | None) -> Scale:
    """The unit of the signal gives the angle of a count; without one, `units_per_turn` of the rig file does."""
    unit_rad = UNITS_RAD.get((signal.unit or "").strip().lower())
    if units_per_turn is not None:
        count_rad = math.tau / units_per_turn
    elif unit_rad is not None:
        count_rad = abs(float(signal.scale)) * unit_rad
    else:
        raise ValueError(f"unit {signal.unit or ''!r} is no angle; give units_per_turn in the rig file")
    if count_rad <= 0.0:
        raise ValueError(f"one count is {count_rad} rad")
    units_per_turn = math.tau / count_rad
    return Scale(units_per_turn, _range(signal, units_per_turn), float(signal.scale) > 0.0)


def _range(signal: Signal, units_per_turn: float) -> int:
    """Counts after which the signal begins again: its stated ends when they are inside its bits, else its bits.

    Both ends are values that it takes, unless they are whole turns apart: then they are one place of the disc, so that
    "[0|360]" in degrees is what "[0|359.9]" with a count of 0.1 is.
    """
    bits = 1 << signal.length
    if signal.minimum is None or signal.maximum is None or signal.maximum <= signal.minimum:
        return bits
    steps = float(signal.maximum - signal.minimum) / abs(float(signal.scale))
    turns = round(steps / units_per_turn)
    whole_turns = turns > 0 and abs(steps - turns * units_per_turn) < 0.5
    return min(round(steps) + (0 if whole_turns else 1), bits)
