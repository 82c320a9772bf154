"""What is sent to a page, as JSON: once the rig, a few times a second the state, 30 times a second the picture.

The picture is the robot with its beam in the base frame, from the newest joint readings and the current model. Ages
instead of times of day: a phone's clock is not this machine's. A face is described by where the light is, how much of
it there is, and what is wrong with it.
"""

from collections.abc import Mapping
from math import isfinite
from typing import Literal

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from acquisition.wires.psd_view import NO_LIGHT, SATURATED, PsdView
from calibeam.live.feed import Progress
from calibeam.live.health import Health
from calibrate.model.arms.rig_arm import RigArm
from calibrate.model.assumed_rig import AssumedRig, Light
from calibrate.model.dual_psd_rig import dual_psd_chain
from drivers.device import Block

Floats = NDArray[np.float64]
Points = list[list[float]]

FREE_BEAM_M = 0.5  # of a beam that meets no face, drawn
NEAR_M = 0.1  # expected to observed spot of a place that can be meant: a fixture set down by hand; feels right


class SceneBeam(Struct, frozen=True):
    """`points_m`: laser, first face, second face; or laser and a point in the air. `says`: where it goes."""

    points_m: Points
    spots_m: list[float] | None  # expected: psd1 x, y, psd2 x, y
    both: bool
    says: str


class SceneFixture(Struct, frozen=True):
    """The fixture in the base: corners (m) of PSD 1, PSD 2. `known`: by the session, else it was guessed."""

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
        if self._arm is None or q_rad.shape != (self._rig.n_joints,) or not np.isfinite(q_rad).all():
            return None
        return self._arm.frames(q_rad[None])[0]

    def beam(self, T_base_flange: Floats, standing: SceneFixture | None) -> SceneBeam | None:
        """None for a rig without laser and fixture."""
        if self._assumed is None:
            return None
        origin, direction = (row.tolist() for row in self._assumed.arm.beam_from(T_base_flange))
        laser_m, far_m = _point(origin), _point([o + FREE_BEAM_M * d for o, d in zip(origin, direction, strict=True)])
        if standing is None:
            return SceneBeam([laser_m, far_m], None, both=False, says="")
        expected_m, light = self._assumed.struck(T_base_flange, standing.placement, standing.first_psd)
        spots_m = [round(value, 9) for value in expected_m.tolist()]
        if light is Light.WRONG_WAY or not all(map(isfinite, spots_m)):
            return SceneBeam([laser_m, far_m], None, both=False, says=light.value)
        one, other = self._faces[standing.placement]
        struck_m = [_on_face(one, *spots_m[:2]), _on_face(other, *spots_m[2:])]
        ordered_m = struck_m if standing.first_psd == 1 else struck_m[::-1]
        return SceneBeam([laser_m, *ordered_m], spots_m, light is Light.BOTH_LIT, light.value)

    def standing(
        self, known: tuple[int, int] | None, T_base_flange: Floats | None, measured_m: list[float] | None
    ) -> SceneFixture | None:
        """As reported; else the place and order by which the beam would strike nearest to the expected light."""
        if self._assumed is None:
            return None
        if known is not None and known[0] in self._faces:
            return SceneFixture(*known, self._corners(known[0]), told=True)
        if T_base_flange is None:
            return None
        spots_m = np.zeros(4) if measured_m is None else np.array(measured_m)
        found = self._nearest(self._assumed, T_base_flange, spots_m)
        return None if found is None else SceneFixture(*found, self._corners(found[0]), told=False)

    def _nearest(self, assumed: AssumedRig, T_base_flange: Floats, spots_m: Floats) -> tuple[int, int] | None:
        off_m: dict[tuple[int, int], float] = {}
        for placement in self._faces:
            for first in (1, 2):
                expected_m, light = assumed.struck(T_base_flange, placement, first)
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
        self._arm = RigArm.of_rig(rig, self._corrections) if rig.n_joints else None
        self._assumed: AssumedRig | None = None
        self._faces: dict[int, tuple[Points, Points]] = {}  # by placement: T_base_face of PSD 1, PSD 2, as lists
        self._half_size_m = 0.0 if fixture is None else fixture.half_size_m
        if tool.laser_origin_m is None or tool.laser_direction is None or fixture is None or not rig.placements:
            return
        assumed = self._assumed = AssumedRig(rig, self._known())
        places = {placement: assumed.T_base_psd1(placement) for placement in assumed.placements}
        self._faces = {k: (T.tolist(), (T @ assumed.T_psd1_psd2).tolist()) for k, T in places.items()}

    def _known(self) -> dict[str, float]:
        """Corrections of this rig's parameters: a session may have a place more than its rig file."""
        ids = np.array(sorted(self._rig.placements), dtype=np.int64)
        names = {p.name for p in dual_psd_chain(self._rig, ids, np.ones_like(ids)).parameters}
        return {name: value for name, value in self._corrections.items() if name in names}


def _on_face(T_base_face: Points, x_m: float, y_m: float) -> list[float]:
    """In the base. Plain numbers: of three of them, an array would be mostly overhead, 30 times a second."""
    return _point([row[0] * x_m + row[1] * y_m + row[3] for row in T_base_face[:3]])


def _point(point_m: list[float]) -> list[float]:
    """To 10 µm: the screen shows no more, and the message is shorter."""
    return [round(value, 5) for value in point_m]


NEWEST = 50  # samples at 1 kHz: longer than a frame at 30 Hz, so that a mean sees them all


class FaceNow(Struct, frozen=True):
    """One face. `state`: "light", "saturated", "no light", or "no spot": light, but beyond the error map, or where no
    spot explains the currents. Positions (m) are None where there is none.
    """

    state: str
    x_m: float | None
    y_m: float | None
    sum_v: float
    half_m: float


def faces_now(view: PsdView, block: Block) -> tuple[FaceNow, FaceNow]:
    """Both faces by the newest samples: one spot of their averaged currents, as sessions average them."""
    current_a = block.values["photocurrent_a"][-NEWEST:].mean(axis=0)
    flags = block.values["flags"][-NEWEST:].astype(np.int64)
    newest, ever = int(flags[-1]), int(np.bitwise_or.reduce(flags))
    return _face(view, 0, current_a[:4], newest, ever), _face(view, 1, current_a[4:], newest, ever)


def _face(view: PsdView, k: int, current_a: NDArray[np.float64], newest: int, ever: int) -> FaceNow:
    """One spot; PsdView.each does the same for many samples, and would take twice the time of one."""
    face, error_map = view.faces[k], view.maps[k]
    reading = face.read(current_a)
    sum_v, half_m = round(float(reading.sum_a) * view.transimpedance_v_a, 4), 0.5 * face.length_m
    corrected = (reading.x_m, reading.y_m) if error_map is None else error_map.correct(reading.x_m, reading.y_m)
    x_m, y_m = (float(value) for value in corrected)
    if newest & NO_LIGHT[k]:
        return FaceNow("no light", None, None, sum_v, half_m)
    if not (isfinite(x_m) and isfinite(y_m)):
        return FaceNow("no spot", None, None, sum_v, half_m)
    return FaceNow("saturated" if ever & SATURATED[k] else "light", round(x_m, 9), round(y_m, 9), sum_v, half_m)


def measured_m(faces: tuple[FaceNow, FaceNow] | None) -> list[float] | None:
    """psd1 x, y, psd2 x, y (4,) where both are lit."""
    found = [value for face in faces or () for value in (face.x_m, face.y_m) if value is not None]
    return found if len(found) == 4 else None


Job = Literal["session", "watch"]
Picture = Literal["now", "state"]  # what is made again at every beat, or at some


class RigMessage(Struct, frozen=True, tag_field="kind", tag="rig"):
    """What does not change."""

    name: str
    job: Job
    software: str
    lower_rad: list[float]
    upper_rad: list[float]
    devices: list[str]
    half_m: float | None  # of a face as stated in the rig
    reach_m: float


class LineMessage(Struct, frozen=True):
    """One line of the log."""

    number: int
    age_s: float
    text: str


class StopMessage(Struct, frozen=True):
    """`ready`: there is an arm that STOP stops; the rest is of the last one pressed."""

    ready: bool
    age_s: float | None = None
    delivered: bool | None = None
    who: str = ""
    says: str = ""


class StateMessage(Struct, frozen=True, tag_field="kind", tag="state"):
    """How things stand."""

    devices: list[Health]
    progress: Progress | None
    lines: list[LineMessage]
    stop: StopMessage
    standing: SceneFixture | None


class TroubleMessage(Struct, frozen=True, tag_field="kind", tag="trouble"):
    """Why the page cannot be shown what it should; over with the next message of the kind `of`."""

    of: Picture
    says: str


class PictureMessage(Struct, frozen=True, tag_field="kind", tag="now"):
    """The newest of everything; None for what has no fresh sample: it is not shown as live."""

    number: int
    faces: tuple[FaceNow, FaceNow] | None
    q_rad: list[float | None] | None  # None: this joint does not answer
    by: str  # the device that gave the joints
    points_m: Points | None  # origins of the base and of every link's frame
    beam: SceneBeam | None
