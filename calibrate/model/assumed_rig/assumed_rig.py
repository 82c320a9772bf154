"""The assumed rig at one pose: expected spots and their derivative by the joints."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.errors import DataError
from calibrate.model.assumed_rig.assumed_arm import believed_arm
from calibrate.model.assumed_rig.assumed_fixture import BelievedFixture, FixtureView, Light
from calibrate.model.dual_psd_rig import dual_psd_chain, dual_psd_of
from calibrate.model.optics import reflection as optics
from calibrate.model.parameters import values_by_name

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Expected:
    """Spots at one pose and their derivative by the joints; defined off the faces too."""

    spots_m: Floats  # (4,) psd1_x, psd1_y, psd2_x, psd2_y
    by_joint: Floats  # (4, joint) m/rad
    light: Light


class BelievedRig:
    """Rig file plus, if there are any, fitted corrections by parameter name; immutable."""

    def __init__(self, rig: Rig, corrections: Mapping[str, float] | None = None) -> None:
        """DataError for a rig without laser or fixture, KeyError for a correction that no parameter has."""
        ids = np.array(sorted(rig.placements), dtype=np.int64)
        sensor, chain = dual_psd_of(rig, ids, np.ones_like(ids)), dual_psd_chain(rig, ids, np.ones_like(ids))
        phi = values_by_name(chain.parameters, corrections or {})[len(chain.model.parameters) :]
        pair, half_size_m = sensor.T_psd1_psd2(phi), sensor.fixture.half_size_m
        self.arm = believed_arm(rig, corrections)
        self.fixture = BelievedFixture(pair, half_size_m)
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
