"""The assumed dual-PSD fixture, one beam at a time: spots, derivative by the beam, and the beam for given spots."""

from enum import Enum

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.model.optics import reflection as optics
from calibrate.model.rigid import inverse

Floats = NDArray[np.float64]


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


class BelievedFixture:
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
