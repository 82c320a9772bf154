"""From the counts of one encoder to a continuous angle."""

import math
from dataclasses import dataclass

from drivers.cia406.objects import Operating

SPEED_LIMIT_RAD_S = (
    100.0  # 16 turns a second: no arm joint turns so fast, even in an emulation run at ten times the pace
)


@dataclass(frozen=True)
class Scale:
    """What the encoder says of its counts."""

    units_per_turn: int
    range_units: int  # the position wraps here
    rises_counter_clockwise: bool

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


class ContinuousAngle:
    """Unwraps one encoder's position. The first reading lies within half the range of zero.

    Step = ((new - old + R/2) mod R) - R/2, R the range in units; a step faster than the speed limit is no motion and
    gives NaN (a glitch, a preset, a wrong wrap), until the time since the last good reading would allow it.
    """

    def __init__(self, scale: Scale, speed_limit_rad_s: float = SPEED_LIMIT_RAD_S) -> None:
        self.jumps = 0
        self._scale = scale
        self._speed_limit_rad_s = speed_limit_rad_s
        self._units: int | None = None  # continuous
        self._time_s = 0.0

    def follow(self, position: int, time_s: float) -> float:
        """Angle in rad for a position read at `time_s`, or NaN."""
        scale = self._scale
        step = self._step(position, 0 if self._units is None else self._units)
        if self._units is not None:
            reach_rad = self._speed_limit_rad_s * (time_s - self._time_s)
            if abs(step * scale.unit_rad) > reach_rad + abs(scale.unit_rad):
                self.jumps += 1
                return math.nan
        self._units = (self._units or 0) + step
        self._time_s = time_s
        return self._units * scale.unit_rad

    def _step(self, position: int, old: int) -> int:
        half = self._scale.range_units // 2
        return (position - old + half) % self._scale.range_units - half
