"""Finding the light: a spiral of the beam across the first face, then of its tilt about the point found there.

Takes the place of the camera of the source: the coarse aim is the nominal rig. An arm whose zeros are off by 2 deg
misses a 20 mm face by up to 40 mm, so the first spiral covers that; with the beam on the first face the direction is
off by the same few degrees only, so the second one is short.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Bench, Look
from acquisition.centring.believed import BelievedArm, FixtureOptics, spots_by_joints
from acquisition.errors import UnreachableError

Floats = NDArray[np.float64]


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
        arm: BelievedArm,
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
