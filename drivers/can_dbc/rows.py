"""Rows of all encoders out of their frames: live ones of `device`, and those of a log.

A row is complete when every encoder has sent, or when one sends again before the others did.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from drivers.can_dbc.description import NoReading
from drivers.cia406.codec import SPEED_LIMIT_RAD_S, ContinuousAngle, Scale


class EncoderSignal(Protocol):
    """One encoder in the frames, such as a `JointSignal` of a DBC file."""

    @property
    def name(self) -> str: ...
    @property
    def frame(self) -> tuple[int, bool]: ...
    @property
    def scale(self) -> Scale: ...
    def counts(self, data: bytes) -> int | NoReading | None: ...


@dataclass(frozen=True)
class EncoderReading:
    """What one frame brought: rad, NaN with the reason; s by the clock of the frames."""

    angle_rad: float
    time_s: float
    missing: NoReading | None = None


@dataclass(frozen=True)
class EncoderRow:
    """The readings by place; slip_rad (joint,), the sum of all steps that were no motion so far."""

    readings: Mapping[int, EncoderReading]
    slip_rad: tuple[float, ...]

    def angles_rad(self) -> tuple[float, ...]:
        """(joint,); NaN where there is none."""
        nothing = EncoderReading(math.nan, math.nan)
        return tuple(self.readings.get(place, nothing).angle_rad for place in range(len(self.slip_rad)))

    def no_reading(self) -> tuple[int, ...]:
        """(joint,); 0 where there is an angle, else the value of a `NoReading`."""
        silent = EncoderReading(math.nan, math.nan, NoReading.NO_ANSWER)
        whys = (self.readings.get(place, silent).missing for place in range(len(self.slip_rad)))
        return tuple(0 if why is None else why.value for why in whys)


class RowsOfFrames:
    """Takes frames in the order of their times, and gives rows.

    `bad_frames`: those that did not fit their signal. `last_read`: the encoders that the last frame was of.
    """

    def __init__(
        self,
        joints: Sequence[EncoderSignal],
        speed_limit_rad_s: float = SPEED_LIMIT_RAD_S,
        acceleration_limit_rad_s2: float = math.inf,
    ) -> None:
        self.joints = tuple(joints)
        self.bad_frames = 0
        self.last_read: tuple[int, ...] = ()
        self._angles = tuple(ContinuousAngle(j.scale, speed_limit_rad_s, acceleration_limit_rad_s2) for j in joints)
        self._places: dict[tuple[int, bool], list[int]] = {}
        for place, joint in enumerate(joints):
            self._places.setdefault(joint.frame, []).append(place)
        self._row: dict[int, EncoderReading] = {}

    def places(self, frame: tuple[int, bool]) -> Sequence[int]:
        """The encoders in frames of this identifier."""
        return self._places.get(frame, ())

    def take(self, frame: tuple[int, bool], data: bytes, time_s: float) -> list[EncoderRow]:
        """The rows that a frame completes: the one before it, the one that it ends, or none."""
        found = [(place, self.joints[place].counts(data)) for place in self.places(frame)]
        read = [(place, counts) for place, counts in found if counts is not None]
        self.bad_frames += len(found) - len(read)
        self.last_read = tuple(place for place, _ in read)
        rows = self.finish() if any(place in self._row for place in self.last_read) else []
        for place, counts in read:
            self._row[place] = self._reading(place, counts, time_s)
        if len(self._row) == len(self.joints):
            rows += self.finish()
        return rows

    def finish(self) -> list[EncoderRow]:
        """The row that was begun, if one was."""
        readings, self._row = self._row, {}
        slips_rad = tuple(angle.slip_rad for angle in self._angles)
        return [EncoderRow(readings, slips_rad)] if readings else []

    def _reading(self, place: int, counts: int | NoReading, time_s: float) -> EncoderReading:
        if isinstance(counts, NoReading):
            return EncoderReading(math.nan, time_s, counts)
        angle_rad = self._angles[place].follow(counts, time_s)
        return EncoderReading(angle_rad, time_s, NoReading.TOO_FAST if math.isnan(angle_rad) else None)
