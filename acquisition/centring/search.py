"""Finding the light: by the camera beside the laser where there is one, else by a spiral of the beam.

The source has such a camera: look, go to where the beam should strike, look again. One look from afar misses by what
the zeros of the arm make of the way; the next one, from the aim itself, leaves millimetres, which the faces of 20 mm
forgive. Without a camera the coarse aim is the nominal rig. An arm whose zeros are off by 2 deg misses a 20 mm face by
up to 40 mm, so the first spiral, across the first face, covers that; with the beam on the first face the direction is
off by the same few degrees only, so the second one, of the tilt about the point found there, is short.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Bench, Look
from acquisition.centring.aim import AssumedArm, BeamTarget, FixtureOptics, flange_for, reach, spots_by_joints
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

    def __init__(self, bench: Bench, sight: Sight, arm: AssumedArm, optics: FixtureOptics) -> None:
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


class Found(Enum):
    """How a search ended."""

    BOTH = "both faces have light"
    FIRST_ONLY = "the first face has light, the second was not found"
    NOTHING = "no light within the search radius"


@dataclass(frozen=True)
class SearchResult:
    """Where the arm stands after a search; `motions` counts every move of it."""

    found: Found
    q_rad: Floats
    look: Look
    motions: int


@dataclass(frozen=True)
class SearchPlan:
    """How far and how finely to look. Pitches are below the lit width of a 20 mm face at 35 deg incidence (16 mm)."""

    pitch_m: float = 0.011
    radius_m: float = 0.066
    tilt_pitch_rad: float = 0.06  # moves the second spot by 5 mm at 80 mm
    tilt_radius_rad: float = 0.30
    centre_steps: int = 8
    centre_m: float = 1.5e-3  # close enough to the first centre before tilting
    dwell_s: float = 0.01


class Search:
    """One search for one fixture place and order; moves in small joint steps from where the arm stands."""

    def __init__(
        self,
        bench: Bench,
        arm: AssumedArm,
        optics: FixtureOptics,
        T_base_fixture: Floats,
        first: int,
        plan: SearchPlan | None = None,
    ) -> None:
        self._bench, self._arm, self._optics, self._T, self._first = bench, arm, optics, T_base_fixture, first
        self._plan = plan or SearchPlan()
        self._motions = 0

    def run(self, q_rad: Floats) -> SearchResult:
        """Search around command `q_rad` (joint,), where the arm stands."""
        look = self._bench.look(self._plan.dwell_s)
        if not look.lit(self._first)[0]:
            q_rad, look = self._spiral(q_rad, self._shifted, _rings(self._plan.pitch_m, self._plan.radius_m), 0)
            if not look.lit(self._first)[0]:
                return SearchResult(Found.NOTHING, q_rad, look, self._motions)
        if all(look.lit(self._first)):
            return SearchResult(Found.BOTH, q_rad, look, self._motions)
        q_rad, look = self._onto_first_centre(q_rad, look)
        if not all(look.lit(self._first)):
            offsets = _rings(self._plan.tilt_pitch_rad, self._plan.tilt_radius_rad)
            q_rad, look = self._spiral(q_rad, self._tilted, offsets, 1)
        found = Found.BOTH if all(look.lit(self._first)) else Found.FIRST_ONLY
        return SearchResult(found, q_rad, look, self._motions)

    def _spiral(
        self, q_rad: Floats, displaced: Callable[[Floats, Floats], Floats], offsets: Iterator[Floats], face: int
    ) -> tuple[Floats, Look]:
        """Move to q_rad displaced by each offset in turn until the face (0 first, 1 second) has light."""
        at, look = q_rad, self._bench.look(self._plan.dwell_s)
        for offset in offsets:
            q_next = displaced(q_rad, offset)
            if np.any(q_next < self._arm.lower_rad) or np.any(q_next > self._arm.upper_rad):
                continue
            try:
                look = self._go(q_next)
            except UnreachableError:  # a box is there: the light may be elsewhere
                continue
            at = q_next
            if look.lit(self._first)[face]:
                break
        return at, look

    def _onto_first_centre(self, q_rad: Floats, look: Look) -> tuple[Floats, Look]:
        """Bring the first spot near its centre, keeping the direction; stops early when the second face lights up."""
        rows = slice(0, 2) if self._first == 1 else slice(2, 4)
        for _ in range(self._plan.centre_steps):
            spot_m = look.spots_m()[rows]
            if all(look.lit(self._first)) or float(np.max(np.abs(spot_m))) < self._plan.centre_m:
                break
            J = spots_by_joints(self._arm, self._optics, self._T, q_rad, self._first)[rows]
            keep_direction = self._arm.beam_jacobian(q_rad)[3:]
            wanted = np.concatenate([-spot_m, np.zeros(3)])
            q_next = q_rad + np.linalg.lstsq(np.vstack([J, keep_direction]), wanted, rcond=1e-6)[0]
            try:
                seen = self._go(q_next)
            except UnreachableError:
                break
            if not seen.lit(self._first)[0]:
                break
            q_rad, look = q_next, seen
        return q_rad, look

    def _shifted(self, q_rad: Floats, offset_m: Floats) -> Floats:
        """Joint readings with the beam shifted square to itself by `offset_m` (2,)."""
        _, across = self._across(q_rad)
        return self._with_beam_change(q_rad, np.concatenate([across @ offset_m, np.zeros(3)]))

    def _tilted(self, q_rad: Floats, tilt_rad: Floats) -> Floats:
        """Joint readings with the beam tilted by `tilt_rad` (2,) about the point where it meets the first face."""
        direction, across = self._across(q_rad)
        turn = across @ tilt_rad
        origin_m, _ = self._arm.beam(q_rad)
        stand_off_m = float((self._T[:3, 3] - origin_m) @ direction)
        return self._with_beam_change(q_rad, np.concatenate([-stand_off_m * turn, turn]))

    def _across(self, q_rad: Floats) -> tuple[Floats, Floats]:
        _, direction = self._arm.beam(q_rad)
        basis = np.linalg.svd(direction[None])[2][1:].T
        return direction, basis

    def _with_beam_change(self, q_rad: Floats, change: Floats) -> Floats:
        """Two linear steps reach a change of some centimetres to better than a millimetre."""
        origin_m, direction = self._arm.beam(q_rad)
        goal = np.concatenate([origin_m, direction]) + change
        for _ in range(2):
            now = np.concatenate(self._arm.beam(q_rad))
            q_rad = q_rad + np.linalg.lstsq(self._arm.beam_jacobian(q_rad), goal - now, rcond=1e-4)[0]
        return q_rad

    def _go(self, q_rad: Floats) -> Look:
        self._bench.move(q_rad)
        self._motions += 1
        return self._bench.look(self._plan.dwell_s)


def _rings(pitch: float, radius: float) -> Iterator[Floats]:
    """Points (2,) of square rings about the origin, nearest ring first, `pitch` apart, the origin left out."""
    for ring in range(1, int(radius / pitch) + 1):
        side = range(-ring, ring + 1)
        points = [(i, -ring) for i in side] + [(ring, j) for j in side][1:]
        points += [(i, ring) for i in reversed(side)][1:] + [(-ring, j) for j in reversed(side)][1:-1]
        for i, j in points:
            yield np.array([i, j]) * pitch
