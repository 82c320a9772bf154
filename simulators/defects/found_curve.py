"""An unknown mechanism: what it does was found as a curve, and here it does just that.

It is a table of what was seen, not a law. Between the rows of the table it is interpolated, beyond them it ends at the
nearest row: nothing is known there.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from simulators.arm.kinematics import Vector, inverse, moved
from simulators.arm.statics import Load
from simulators.defects.defect import ANY_INSTRUMENT, UNKNOWN, Defect
from simulators.defects.scene import Light, Scene

Floats = NDArray[np.float64]
Rows = tuple[tuple[float, ...], ...]
NEAR = 1e-6  # of a driver's range: rows closer than that are one
KEPT = 32  # tables
WALLS = 60  # rows near a place that its value is worked out from


@dataclass(frozen=True)
class FoundCurve(Defect):
    """What was found at a port: rows of drivers (`knots`) and what is added there (`amounts`), of one length each.

    `by` names the drivers in the words of the interchange format, each with as many columns of `knots` as it has
    numbers.
    """

    by: tuple[str, ...]
    knots: Rows
    amounts: Rows
    share: float = 1.0

    PHYSICS = UNKNOWN
    INSTRUMENTS = ANY_INSTRUMENT

    @property
    def drivers(self) -> tuple[str, ...]:
        return self.by

    def added(self, scene: Scene, load: Load | None, own: Floats | None = None) -> Floats:
        """(row, width); `own`: (row, k) what an instrument sees, for a curve over that."""
        columns = [_driver(name, scene, load, own) for name in self.by]
        at = np.concatenate([c if c.ndim == 2 else c[:, np.newaxis] for c in columns], axis=1)
        return self.share * table(self.knots, self.amounts)(at)


@dataclass(frozen=True)
class CurveAtJoints(FoundCurve):
    """Turns the joints: rad, one a joint."""

    KIND = "curve-at-joints"
    PORT = "joint.angle"

    def extra_turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        return self.added(scene, load)


@dataclass(frozen=True)
class CurveAtLink(FoundCurve):
    """Shifts (m) and turns (rad) the frame that stands at `origin_m`, `rotation_rad` of the start of a link."""

    link: int = 0
    origin_m: Vector = (0.0, 0.0, 0.0)
    rotation_rad: Vector = (0.0, 0.0, 0.0)

    KIND = "curve-at-link"
    PORT = "link{link}.tilt"

    @property
    def links(self) -> tuple[int, ...]:
        return (self.link,)

    def link_motion(self, link: int, end_m: Floats, angle_rad: Floats, scene: Scene, load: Load) -> Floats:
        six = self.added(scene, load)
        frame = moved(self.origin_m, self.rotation_rad)
        return frame @ moved(six[:, :3], six[:, 3:]) @ inverse(frame)


@dataclass(frozen=True)
class CurveAtBase(FoundCurve):
    """Shifts (m) and turns (rad) all that stands around the arm, in the base frame."""

    KIND = "curve-at-base"
    PORT = "base.pose"

    def base_motion(self, scene: Scene, load: Load) -> Floats:
        six = self.added(scene, load)
        return inverse(moved(six[:, :3], six[:, 3:]))


@dataclass(frozen=True)
class CurveInReading(FoundCurve):
    """Falsifies what an instrument gives, in its unit: the spots of both PSDs, a position or a length."""

    of: Literal["spots", "position", "length"] = "spots"

    KIND = "curve-in-reading"
    PORT = "device.reading"

    def seen_spots_m(self, spot_m: Floats, light: Light, scene: Scene) -> Floats:
        if self.of != "spots":
            return spot_m
        return spot_m + self.added(scene, None, light.spot_m.reshape(-1, 4)).reshape(-1, 2, 2)

    def seen_position_m(self, position_m: Floats, scene: Scene) -> Floats:
        return position_m + self.added(scene, None, position_m)[:, :3] if self.of == "position" else position_m

    def seen_length_m(self, length_m: Floats, scene: Scene) -> Floats:
        if self.of != "length":
            return length_m
        return length_m + self.added(scene, None, length_m[:, np.newaxis])[:, 0]


def _driver(name: str, scene: Scene, load: Load | None, own: Floats | None) -> Floats:
    """(row,) or (row, k)"""
    stem, number = name.rstrip("0123456789"), name[len(name.rstrip("0123456789")) :]
    joint = int(number) - 1 if number else 0
    if name == "t":
        return scene.t_s
    if stem == "q" and number:
        return scene.goal_rad[:, joint]
    if stem == "gravity_torque" and load is not None:
        return load.torque_nm[:, joint]
    if stem == "qd":
        return scene.qd_rad_s[:, joint]
    if stem == "last_move":
        return scene.last_move_rad[:, joint]
    if stem == "cmd_minus_q" and scene.asked_rad is not None:
        return scene.asked_rad[:, joint]
    if stem == "approach":
        return np.sign(scene.goal_rad - scene.via_rad)[:, joint]
    if stem == "spot" and own is not None:
        return own[:, 2 * joint : 2 * joint + 2]
    if name == "reading" and own is not None:
        return own
    if name == "payload":
        return scene.payload_kg
    if name.startswith("temp_"):
        return scene.temperature_degC[name.removeprefix("temp_")]
    if name in scene.extra:
        return scene.extra[name]
    raise KeyError(name)


class Table:
    """Values (row, width) over drivers (row, d)."""

    def __init__(self, at: Floats, values: Floats) -> None:
        self._low, self._high = at.min(axis=0), at.max(axis=0)
        self._scale = np.maximum(self._high - self._low, 1e-300)
        _, first = np.unique(np.round(at / self._scale / NEAR), axis=0, return_index=True)
        self._at, self._values = at[first] / self._scale, values[first]
        if at.shape[1] == 1 or len(first) < 4 + at.shape[1]:
            self._smooth = None
        else:
            self._smooth = scipy.interpolate.RBFInterpolator(self._at, self._values, neighbors=min(WALLS, len(first)))

    def __call__(self, at: Floats) -> Floats:
        """At drivers (row, d); what is beyond the table takes the nearest of its rows."""
        outside = np.any((at < self._low) | (at > self._high), axis=1)
        scaled = np.clip(at, self._low, self._high) / self._scale
        if at.shape[1] == 1:
            x = self._at[:, 0]
            return np.stack([np.interp(scaled[:, 0], x, column) for column in self._values.T], axis=1)
        nearest = np.argmin(np.linalg.norm(scaled[:, np.newaxis] - self._at, axis=2), axis=1)
        held = self._values[nearest]
        if self._smooth is None:
            return held
        beyond = outside[:, np.newaxis]
        return np.where(beyond, held, self._smooth(np.where(beyond, self._at[nearest], scaled)))


@lru_cache(maxsize=KEPT)
def table(knots: Rows, amounts: Rows) -> Table:
    """The table of a mechanism, made once."""
    return Table(np.asarray(knots, dtype=np.float64), np.asarray(amounts, dtype=np.float64))
