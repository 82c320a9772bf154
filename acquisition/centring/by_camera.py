"""Coarse aim by the camera beside the laser: look, go to where the beam should strike, look again.

The source has such a camera. One look from afar misses by what the arm's zeros make of the way; the next one, from the
aim itself, leaves millimetres, which the faces of 20 mm forgive.
"""

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Bench
from acquisition.centring.aim import BeamTarget, flange_for, reach
from acquisition.centring.believed import BelievedArm, FixtureOptics
from acquisition.centring.camera.board import Sight
from acquisition.errors import UnreachableError

Floats = NDArray[np.float64]

LOOKS = 6
GLANCE_S = 0.01
# About the asked-for roll: where the arm cannot stand so, the beam may as well come with the flange turned about it.
OTHER_ROLLS_RAD = (0.0, 0.5, -0.5, 1.0, -1.0, 1.5, -1.5, 2.0, -2.0)


class Aimed(Enum):
    """How an aim by camera ended."""

    LIT = "both faces have light"
    DARK = "the camera sees the board, but the beam does not meet both faces"
    UNSEEN = "the camera does not see the board"
    UNREACHABLE = "the arm cannot stand where the beam would meet both faces"


@dataclass(frozen=True, eq=False)
class CameraAim:
    """Where the arm stands after it, at command `q_rad`; the fixture as assumed there, and the roll that it took."""

    aimed: Aimed
    target: BeamTarget
    q_rad: Floats
    T_base_fixture: Floats
    motions: int


class Aim:
    """One aim; the only owner of where the arm stands meanwhile."""

    def __init__(self, bench: Bench, sight: Sight, arm: BelievedArm, optics: FixtureOptics) -> None:
        self._bench, self._sight, self._arm, self._optics = bench, sight, arm, optics
        self._motions = 0

    def run(self, target: BeamTarget, q_rad: Floats, T_base_fixture: Floats, rng: np.random.Generator) -> CameraAim:
        """From command `q_rad` (joint,), where the arm stands; `T_base_fixture` as known so far."""
        fixture, seen_rad = T_base_fixture, None
        for _ in range(LOOKS):
            found = self._sight.fixture(self._arm, q_rad, fixture)
            if found is None and seen_rad is None:
                return CameraAim(Aimed.UNSEEN, target, q_rad, fixture, self._motions)
            if found is None:  # the way led the board out of the picture: half of it back
                try:
                    q_rad = self._go(0.5 * (q_rad + np.asarray(seen_rad)))
                except UnreachableError:  # a box in between: the search begins from where it stands
                    return CameraAim(Aimed.DARK, target, q_rad, fixture, self._motions)
                continue
            fixture, seen_rad = found, q_rad
            stance = self._stand(target, q_rad, fixture, rng)
            if stance is None:
                return CameraAim(Aimed.UNREACHABLE, target, q_rad, fixture, self._motions)
            target, q_rad = stance
            if all(self._bench.look(GLANCE_S).lit(target.first)):
                return CameraAim(Aimed.LIT, target, q_rad, fixture, self._motions)
        return CameraAim(Aimed.DARK, target, q_rad, fixture, self._motions)

    def _stand(
        self, target: BeamTarget, q_rad: Floats, T: Floats, rng: np.random.Generator
    ) -> tuple[BeamTarget, Floats] | None:
        """The target with the first roll in which the arm can stand so and come there, and its joint readings."""
        for other_rad in OTHER_ROLLS_RAD:
            rolled = replace(target, roll_rad=target.roll_rad + other_rad)
            try:
                return rolled, self._go(reach(self._arm, flange_for(self._arm, self._optics, T, rolled), q_rad, rng))
            except UnreachableError:  # no such posture, or the way there is not free
                continue
        return None

    def _go(self, q_rad: Floats) -> Floats:
        self._bench.move(q_rad)
        self._motions += 1
        return q_rad
