"""A wrong start bit or byte order of a DBC signal, by its own frames: the angle jumps, elsewhere it would be smooth.

A joint turns no faster than the speed limit, so that nearly all steps between frames of the right place are motion.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.can_dbc.description import FLOAT_STEPS, JointSignal
from drivers.cia406.codec import SPEED_LIMIT_RAD_S, TIME_SCATTER_S

JUMPING = 0.05  # of the steps beyond the speed limit: no line loses so many
SMOOTH = 0.002  # of the steps, at most, in a place that is proposed: a counter of 8 bits overflows more often
FEWEST = 20  # frames that show it
MOST = 5000  # frames that are examined
ALIKE = 0.99  # of the steps of a counter, which may overflow or miss a frame
BITS_EXAMINED = 64  # bits of a classic frame; encoders use no longer ones
TURNED_COUNTS = 50  # a place that changes by less shows no motion above its last digits
ROUGH = 0.1  # of the whole way, the mean change of a step, at most: bits of an angle beside empty ones change by more
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Layout:
    """The place of a signal in its frame, in the numbers of a DBC file."""

    start: int
    length: int
    little: bool
    signed: bool

    @property
    def text(self) -> str:
        """As a DBC file has it: "7|16@0+"."""
        return f"{self.start}|{self.length}@{int(self.little)}{'-' if self.signed else '+'}"

    @property
    def first(self) -> int:
        """Number of its first bit: little-endian from the least, big-endian from the most significant of a byte."""
        return self.start if self.little else 8 * (self.start // 8) + 7 - self.start % 8


@dataclass(frozen=True)
class Jumps:
    """A signal that jumps from frame to frame: how many of its steps, and the place where it is smooth, if one is."""

    joint: JointSignal
    stated: Layout
    smooth: Layout | None
    jumps: int
    steps: int

    def __str__(self) -> str:
        place = f"{self.joint.source}: {self.joint.name} as {self.stated.text}"
        found = f"{self.jumps} of {self.steps} steps between frames are faster than {SPEED_LIMIT_RAD_S:g} rad/s"
        if self.smooth is None:
            return f"{place}: {found}, and no other place of the frame is smooth; check the factor and the wiring"
        return f"{place}: {found}; as {self.smooth.text} the same frames are smooth: correct the DBC file, import again"


def jumps_of(joint: JointSignal, times_s: Sequence[float], payloads: Sequence[bytes]) -> Jumps | None:
    """Of frames of this signal in the order of their times; None where it moves as a joint does, or in too few."""
    signal = joint.signal
    stated = Layout(signal.start, signal.length, signal.byte_order == "little_endian", signal.is_signed)
    same = [(t, data) for t, data in zip(times_s, payloads, strict=True) if len(data) == len(payloads[0])][:MOST]
    if len(same) < FEWEST:
        return None
    frames = np.frombuffer(b"".join(data for _, data in same), dtype=np.uint8).reshape(len(same), -1)
    allowed = _allowed_counts(joint, np.array([t for t, _ in same]))
    own = _values(frames, stated, is_float=signal.is_float)
    if own is None:
        return None
    jumps = _jumps(own, allowed, stated, is_float=signal.is_float)
    if jumps < JUMPING * len(allowed):
        return None
    return Jumps(joint, stated, _smooth(frames, stated, allowed, is_float=signal.is_float), jumps, len(allowed))


def _allowed_counts(joint: JointSignal, times_s: Floats) -> Floats:
    """(step,) what a joint can turn between two frames, in the signal's raw numbers."""
    raw_rad = abs(joint.scale.unit_rad) * (FLOAT_STEPS if joint.signal.is_float else 1)
    return SPEED_LIMIT_RAD_S * np.maximum(np.diff(times_s), TIME_SCATTER_S) / raw_rad + 1.0


def _smooth(frames: NDArray[np.uint8], stated: Layout, allowed: Floats, *, is_float: bool) -> Layout | None:
    """The nearest place where the angle turns smoothly; whole bytes first, if it is as long as bytes are."""
    found: list[tuple[tuple[bool, int, float], Layout]] = []
    for layout in _others(stated, 8 * frames.shape[1]):
        values = _values(frames, layout, is_float=is_float)
        if values is None:
            continue
        steps = _steps(values, layout, is_float=is_float)
        way = float(np.ptp(np.cumsum(steps)))
        rough = float(np.mean(np.abs(np.diff(steps))))
        if _counts_frames(steps) or way == 0.0 or rough > ROUGH * way or (not is_float and way < TURNED_COUNTS):
            continue
        if _jumps(values, allowed, layout, is_float=is_float) <= SMOOTH * len(allowed):
            odd = layout.length % 8 == 0 and layout.first % 8 != 0
            found.append(((odd, abs(layout.first - stated.first), rough), layout))
    return min(found, key=lambda each: each[0])[1] if found else None


def _others(stated: Layout, bits: int) -> Iterator[Layout]:
    """Every other place of the same length, in both byte orders."""
    for little in (stated.little, not stated.little):
        for first in range(min(bits, BITS_EXAMINED) - stated.length + 1):
            start = first if little else 8 * (first // 8) + 7 - first % 8
            layout = Layout(start, stated.length, little, stated.signed)
            if layout != stated:
                yield layout


def _values(frames: NDArray[np.uint8], layout: Layout, *, is_float: bool) -> Floats | None:
    """(frame,) raw numbers; None where the frames are too short, or hold no finite ones."""
    bits = np.unpackbits(frames, axis=1, bitorder="little" if layout.little else "big")
    bits = bits[:, layout.first : layout.first + layout.length]
    if bits.shape[1] < layout.length or layout.length > BITS_EXAMINED:
        return None
    bits = bits if layout.little else bits[:, ::-1]  # from the least significant on
    if is_float:
        packed = np.ascontiguousarray(np.packbits(bits, axis=1, bitorder="little"))
        with np.errstate(invalid="ignore"):
            values = packed.view(f"<f{layout.length // 8}")[:, 0].astype(np.float64)
        return values if bool(np.isfinite(values).all()) else None
    return bits.astype(np.float64) @ np.exp2(np.arange(layout.length))


def _counts_frames(steps: Floats) -> bool:
    """Whether nearly all steps are the same: a counter of frames, beside bits that do not change."""
    return float(np.mean(steps == np.median(steps))) > ALIKE


def _steps(values: Floats, layout: Layout, *, is_float: bool) -> Floats:
    """(frame - 1,) changes; a number that overflows goes on behind its bits."""
    half = 0.5 * 2.0**layout.length
    return np.diff(values) if is_float else (np.diff(values) + half) % (2.0 * half) - half


def _jumps(values: Floats, allowed: Floats, layout: Layout, *, is_float: bool) -> int:
    """Steps that are no motion."""
    if not is_float:
        allowed = np.minimum(allowed, 0.25 * 2.0**layout.length)  # of a coarse signal every step would be motion
    return int(np.count_nonzero(np.abs(_steps(values, layout, is_float=is_float)) > allowed))
