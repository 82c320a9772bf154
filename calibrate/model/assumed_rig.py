"""The rig as assumed before calibration: where spots fall at a pose, for alignment and for the report.

An arm with its laser (what servo and pose plan need), the dual-PSD fixture (spots, their derivative by the beam, and
the beam for given spots), and both together. One pose, one beam at a time.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.errors import DataError
from calibrate.model.arms.coupled_readings import by_readings
from calibrate.model.arms.rig_arm import RigArm
from calibrate.model.dual_psd_rig import dual_psd_chain, dual_psd_of, laser_of
from calibrate.model.optics import laser as optics
from calibrate.model.parameters import values_by_name
from calibrate.model.rigid import cross, inverse

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class AssumedArm(RigArm):
    """Implements `acquisition.centring.aim.AssumedArm`."""

    laser_origin_m: Floats  # (3,) in the flange
    laser_direction: Floats  # (3,) unit

    def beam(self, q_rad: Floats) -> tuple[Floats, Floats]:
        """Origin (3,) m and unit direction (3,) of the laser beam in the base, for readings (joint,)."""
        return self.beam_from(self.flange(q_rad))

    def beam_jacobian(self, q_rad: Floats) -> Floats:
        """(6, joint) d(origin, direction)/dq: z x (origin - o), z x direction by the turn of a joint."""
        T = self.frames(q_rad[None])[0]
        (origin, direction), axes = self.beam_from(T[-1]), T[:-1, :3, 2]
        by_angle = np.concatenate([cross(axes, origin - T[:-1, :3, 3]), cross(axes, direction)], axis=1).T
        return by_readings(self.by_reading, by_angle)

    def beam_from(self, T_base_flange: Floats) -> tuple[Floats, Floats]:
        """The beam at a flange pose (4, 4)."""
        R = T_base_flange[:3, :3]
        return R @ self.laser_origin_m + T_base_flange[:3, 3], R @ self.laser_direction


def assumed_arm(rig: Rig, corrections: Mapping[str, float] | None = None) -> AssumedArm:
    """`corrections`: fitted values by parameter name, of which it takes those of arm and laser. DataError: no laser."""
    laser, given = laser_of(rig), corrections or {}
    known = {p.name for p in laser.parameters}
    mount = values_by_name(laser.parameters, {k: v for k, v in given.items() if k in known})
    origin_m, direction = laser.in_flange(mount)
    unit = direction / np.linalg.norm(direction)
    return AssumedArm(**vars(RigArm.of_rig(rig, given)), laser_origin_m=origin_m, laser_direction=unit)


class Light(Enum):
    """Where a beam goes, as assumed."""

    BOTH_LIT = "the beam strikes the first face and is reflected onto the second"
    OFF_FACE = "the beam meets a face's plane beside the face"
    WRONG_WAY = "the beam comes from behind a face, leads away from it, or meets the faces in the other order"


class FixtureView:
    """Both faces as an unreflected beam sees them in one order, from a frame where the fixture is at T_frame_psd1."""

    def __init__(self, T_frame_psd1: Floats, T_psd1_psd2: Floats, first_psd: int, half_size_m: float) -> None:
        """DataError unless `first_psd` is 1 or 2."""
        if first_psd not in (1, 2):
            raise DataError(f"first_psd {first_psd}: the beam strikes PSD 1 or PSD 2 first; give 1 or 2")
        self._faces = optics.unfolded_faces(T_frame_psd1, T_psd1_psd2, first_psd)
        self._first_row, self._half_size_m = first_psd - 1, half_size_m

    def strike(self, origin_m: Floats, direction: Floats) -> optics.Strike:
        """Origin (3,) and direction (3,) in the frame of the view; infinite spots for a beam along a face."""
        return optics.strike(optics.Beam(origin_m, direction), self._faces)

    def light(self, hit: optics.Strike) -> Light:
        """Where the beam goes that strikes there."""
        first, second = float(hit.travel_m[self._first_row]), float(hit.travel_m[1 - self._first_row])
        if not (0.0 < first < second and float(hit.facing.max()) < 0.0):
            return Light.WRONG_WAY
        return Light.BOTH_LIT if float(np.abs(hit.spots_m).max()) <= self._half_size_m else Light.OFF_FACE


class AssumedFixture:
    """The fixture in its own frame, that of PSD 1."""

    def __init__(self, T_psd1_psd2: Floats, half_size_m: float) -> None:
        self.half_size_m = half_size_m
        self._T_psd1_face = {1: np.eye(4), 2: T_psd1_psd2}
        self._views = {first: FixtureView(np.eye(4), T_psd1_psd2, first, half_size_m) for first in (1, 2)}

    def spots(self, origin_m: Floats, direction: Floats, first: int) -> Floats:
        """(4,) m psd1 x, y, psd2 x, y, on the faces continued as planes."""
        return self._view(first).strike(origin_m, direction).spots_m.ravel()

    def spots_by_beam(self, origin_m: Floats, direction: Floats, first: int) -> Floats:
        """(4, 6) d(spots)/d(origin, direction)."""
        return optics.by_beam(self._view(first).strike(origin_m, direction))

    def light(self, origin_m: Floats, direction: Floats, first: int) -> Light:
        """Whether that beam really lights both faces in that order."""
        view = self._view(first)
        return view.light(view.strike(origin_m, direction))

    def line(self, spots_m: Floats, first: int) -> tuple[Floats, Floats]:
        """The incoming beam for these spots (4,) m: its point on the first face (3,) and unit direction (3,).

        It runs from that point to the mirror image of the other spot in the first face (optics.py).
        """
        self._view(first)
        at = {k: self._T_psd1_face[k] @ np.array([*spots_m[2 * k - 2 : 2 * k], 0.0, 1.0]) for k in (1, 2)}
        face = self._T_psd1_face[first]
        image = face @ optics.MIRROR_Z @ inverse(face) @ at[3 - first]
        run = (image - at[first])[:3]
        return at[first][:3], run / np.linalg.norm(run)

    def _view(self, first: int) -> FixtureView:
        view = self._views.get(first)
        if view is None:
            raise DataError(f"first_psd {first}: the beam strikes PSD 1 or PSD 2 first; give 1 or 2")
        return view


@dataclass(frozen=True)
class Expected:
    """Spots at one pose and their derivative by the joints; defined off the faces too."""

    spots_m: Floats  # (4,) psd1_x, psd1_y, psd2_x, psd2_y
    by_joint: Floats  # (4, joint) m/rad
    light: Light


class AssumedRig:
    """Rig file plus, if there are any, fitted corrections by parameter name; immutable."""

    def __init__(self, rig: Rig, corrections: Mapping[str, float] | None = None) -> None:
        """DataError for a rig without laser or fixture, KeyError for a correction that no parameter has."""
        ids = np.array(sorted(rig.placements), dtype=np.int64)
        sensor, chain = dual_psd_of(rig, ids, np.ones_like(ids)), dual_psd_chain(rig, ids, np.ones_like(ids))
        phi = values_by_name(chain.parameters, corrections or {})[len(chain.model.parameters) :]
        pair, half_size_m = sensor.T_psd1_psd2(phi), sensor.fixture.half_size_m
        self.arm = assumed_arm(rig, corrections)
        self.fixture = AssumedFixture(pair, half_size_m)
        self.T_psd1_psd2 = pair
        self._gain = phi[4:8]
        self._poses = {int(k): sensor.T_base_psd1(phi, int(k)) for k in ids}
        self._views = {
            (k, first): FixtureView(pose, pair, first, half_size_m)
            for k, pose in self._poses.items()
            for first in (1, 2)
        }

    @property
    def placements(self) -> tuple[int, ...]:
        """Ids, rising."""
        return tuple(self._poses)

    def T_base_psd1(self, placement: int) -> Floats:
        """(4, 4) where PSD 1 is assumed to be. DataError for an unknown placement."""
        if placement not in self._poses:
            known = ", ".join(map(str, self._poses))
            raise DataError(f"placement {placement} is not in the rig (known: {known}); add a [[placement]]")
        return self._poses[placement].copy()

    def flange(self, q_rad: Floats) -> Floats:
        """T_base_flange (4, 4) at joint readings (joint,)."""
        return self.arm.flange(q_rad)

    def beam(self, q_rad: Floats) -> tuple[Floats, Floats]:
        """Origin (3,) m and unit direction (3,) of the laser beam in the base."""
        return self.arm.beam(q_rad)

    def expect(self, q_rad: Floats, placement: int, first_psd: int) -> Expected:
        """Spots and their derivative. DataError for an unknown placement or order."""
        view = self._view(placement, first_psd)
        hit = view.strike(*self.arm.beam(q_rad))
        by_joint = optics.by_beam(hit) @ self.arm.beam_jacobian(q_rad)
        return Expected(hit.spots_m.ravel() * self._gain, by_joint * self._gain[:, None], view.light(hit))

    def spots(self, q_rad: Floats, placement: int, first_psd: int) -> Floats:
        """(4,) m, as in `expect`."""
        return self.expect(q_rad, placement, first_psd).spots_m

    def struck(self, T_base_flange: Floats, placement: int, first_psd: int) -> tuple[Floats, Light]:
        """Spots (4,) m and where the beam goes, as in `expect`, of a flange pose (4, 4): five times as fast."""
        view = self._view(placement, first_psd)
        hit = view.strike(*self.arm.beam_from(T_base_flange))
        return hit.spots_m.ravel() * self._gain, view.light(hit)

    def _view(self, placement: int, first_psd: int) -> FixtureView:
        view = self._views.get((placement, first_psd))
        if view is None:
            self.T_base_psd1(placement)
            raise DataError(f"first_psd {first_psd}: the beam strikes PSD 1 or PSD 2 first; give 1 or 2")
        return view
