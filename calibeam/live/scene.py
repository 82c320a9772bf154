"""The robot with its beam in the base frame, from the newest joint readings and the model that is believed now."""

from collections.abc import Mapping
from math import isfinite

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from acquisition.recording.rig_schema import Rig
from calibrate.arms.rig_arm import RigArm
from calibrate.believed import BelievedRig
from calibrate.believed_fixture import Light
from calibrate.dual_psd_rig import dual_psd_chain

Floats = NDArray[np.float64]
Points = list[list[float]]

FREE_BEAM_M = 0.5  # of a beam that meets no face, drawn
NEAR_M = 0.1  # expected to observed spot of a place that can be meant: a fixture set down by hand; feels right


class Beam(Struct, frozen=True):
    """`points_m`: laser, first face, second face; or laser and a point in the air. `says`: where it goes."""

    points_m: Points
    spots_m: list[float] | None  # expected: psd1 x, y, psd2 x, y
    both: bool
    says: str


class Standing(Struct, frozen=True):
    """The fixture in the base: corners (m) of PSD 1, PSD 2. `told`: the session says so, else it was guessed."""

    placement: int
    first_psd: int
    corners_m: list[Points]
    told: bool


class Scene:
    """Of one rig, by one thread. What there is no model of, or no posture for, is None."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._corrections: Mapping[str, float] = {}
        self._rebuild()

    def believe(self, rig: Rig, corrections: Mapping[str, float]) -> None:
        """The rig may have places more than before. Cheap when both are those of the last time."""
        if rig is not self._rig or corrections is not self._corrections:
            self._rig, self._corrections = rig, corrections
            self._rebuild()

    def frames(self, q_rad: Floats) -> Floats | None:
        """T_base_frame (joint + 1, 4, 4); None for readings of another arm, or of a joint that does not answer."""
        if q_rad.shape != (self._rig.n_joints,) or not np.isfinite(q_rad).all():
            return None
        return self._arm.frames(q_rad[None])[0]

    def beam(self, T_base_flange: Floats, standing: Standing | None) -> Beam | None:
        """None for a rig without laser and fixture."""
        if self._believed is None:
            return None
        origin, direction = (row.tolist() for row in self._believed.arm.beam_from(T_base_flange))
        laser_m, far_m = _point(origin), _point([o + FREE_BEAM_M * d for o, d in zip(origin, direction, strict=True)])
        if standing is None:
            return Beam([laser_m, far_m], None, both=False, says="")
        expected_m, light = self._believed.struck(T_base_flange, standing.placement, standing.first_psd)
        spots_m = [round(value, 9) for value in expected_m.tolist()]
        if light is Light.WRONG_WAY or not all(map(isfinite, spots_m)):
            return Beam([laser_m, far_m], None, both=False, says=light.value)
        one, other = self._faces[standing.placement]
        struck_m = [_on_face(one, *spots_m[:2]), _on_face(other, *spots_m[2:])]
        ordered_m = struck_m if standing.first_psd == 1 else struck_m[::-1]
        return Beam([laser_m, *ordered_m], spots_m, light is Light.BOTH_LIT, light.value)

    def standing(
        self, told: tuple[int, int] | None, T_base_flange: Floats | None, measured_m: list[float] | None
    ) -> Standing | None:
        """As told; else the place and order by which the beam would strike nearest to where light is, or should be."""
        if self._believed is None:
            return None
        if told is not None and told[0] in self._faces:
            return Standing(*told, self._corners(told[0]), told=True)
        if T_base_flange is None:
            return None
        spots_m = np.zeros(4) if measured_m is None else np.array(measured_m)
        found = self._nearest(self._believed, T_base_flange, spots_m)
        return None if found is None else Standing(*found, self._corners(found[0]), told=False)

    def _nearest(self, believed: BelievedRig, T_base_flange: Floats, spots_m: Floats) -> tuple[int, int] | None:
        off_m: dict[tuple[int, int], float] = {}
        for placement in self._faces:
            for first in (1, 2):
                expected_m, light = believed.struck(T_base_flange, placement, first)
                if light is not Light.WRONG_WAY:
                    off_m[placement, first] = float(np.max(np.abs(expected_m - spots_m)))
        near = min(off_m, key=lambda place: off_m[place], default=None)
        return near if near is not None and off_m[near] <= NEAR_M else None

    def _corners(self, placement: int) -> list[Points]:
        h = self._half_size_m
        square_m = ((-h, -h), (h, -h), (h, h), (-h, h))
        return [[_on_face(rows, x_m, y_m) for x_m, y_m in square_m] for rows in self._faces[placement]]

    def _rebuild(self) -> None:
        rig, tool, fixture = self._rig, self._rig.tool, self._rig.fixture
        self._arm = RigArm.of_rig(rig, self._corrections)
        self._believed: BelievedRig | None = None
        self._faces: dict[int, tuple[Points, Points]] = {}  # by placement: T_base_face of PSD 1, PSD 2, as lists
        self._half_size_m = 0.0 if fixture is None else fixture.half_size_m
        if tool.laser_origin_m is None or tool.laser_direction is None or fixture is None or not rig.placements:
            return
        believed = self._believed = BelievedRig(rig, self._known())
        places = {placement: believed.T_base_psd1(placement) for placement in believed.placements}
        self._faces = {k: (T.tolist(), (T @ believed.T_psd1_psd2).tolist()) for k, T in places.items()}

    def _known(self) -> dict[str, float]:
        """Corrections of this rig's parameters: a session may have a place more than its rig file."""
        ids = np.array(sorted(self._rig.placements), dtype=np.int64)
        names = {p.name for p in dual_psd_chain(self._rig, ids, np.ones_like(ids)).parameters}
        return {name: value for name, value in self._corrections.items() if name in names}


def _on_face(T_base_face: Points, x_m: float, y_m: float) -> list[float]:
    """In the base. Plain numbers: of three of them, an array would be mostly overhead, 30 times a second."""
    return _point([row[0] * x_m + row[1] * y_m + row[3] for row in T_base_face[:3]])


def _point(point_m: list[float]) -> list[float]:
    """To 10 um: the screen shows no more, and the message is shorter."""
    return [round(value, 5) for value in point_m]
