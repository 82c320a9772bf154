"""How a camera is measured: a tour round the board for lens and mount, then a few poses with light for the beam.

The tour sees the board from all round, near and far, turned, and not only in the middle: rotations about two axes
across each other fix the mount; tilts of the board against the picture fix the focal length.

Hand-eye calibration gives the mount in the flange as the arm's readings have it, whose last zero may be wrong by
degrees; the laser is drawn in the flange as built. What an aim wants is neither, but the laser's line before the
camera. A pose with light on both faces gives it: the spots fix the beam in the fixture (FixtureOptics.line), the
picture the fixture before the camera. The arm takes no part in it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.bench import Bench
from acquisition.centring.aim import AssumedArm, BeamTarget, flange_for, laser_in_flange, reach
from acquisition.centring.camera.board import Board, Eye, Sight
from acquisition.centring.camera.calibration import Calibration, CameraStatus, View, calibrate_camera
from acquisition.centring.camera.model import CameraFit, CameraModel, drawn
from acquisition.centring.navigator import Navigator
from acquisition.errors import SpotLostError, UnreachableError
from acquisition.motion.kinematics import flange, inverse, transform
from acquisition.recording.rig import Camera
from acquisition.session.records import Events, Learner

Floats = NDArray[np.float64]

TILTS_RAD = (0.0, 0.35, 0.6)  # of the view against the board's normal
AZIMUTHS = 5  # on every tilt but the first
TOUR_ROLLS_RAD = (-0.5, 0.0, 0.5)  # about the view
SHARES = (0.14, 0.20, 0.28)  # of the picture's width that the board takes: far to near
OFF_CENTRE = 0.25  # of half the picture, by which the view passes the board


def viewpoints(model: CameraModel, radius_m: float) -> Iterator[Floats]:
    """T_board_camera (4, 4); `radius_m` of the board."""
    half_view = 0.5 * model.size_px[0] / model.matrix_px[0, 0]
    stops = [(tilt, k) for tilt in TILTS_RAD for k in range(1 if tilt == 0.0 else AZIMUTHS)]
    for number, (tilt, k) in enumerate(stops):
        azimuth = 2.0 * np.pi * (k + 0.5 * (number % 2)) / AZIMUTHS
        distance_m = radius_m / (SHARES[number % len(SHARES)] * half_view)
        towards = transform(rotation_rad=tilt * np.array([np.cos(azimuth), np.sin(azimuth), 0.0]))
        upright = transform((0.0, 0.0, distance_m), (np.pi, 0.0, 0.0))  # x right, y down, z onto the board
        passed = OFF_CENTRE * half_view * np.array([np.cos(3.0 * azimuth), np.sin(3.0 * azimuth)])
        aside = transform(rotation_rad=(passed[1], -passed[0], 0.0))
        roll = transform(rotation_rad=(0.0, 0.0, TOUR_ROLLS_RAD[number % len(TOUR_ROLLS_RAD)]))
        yield towards @ upright @ aside @ roll


def stops(
    arm: AssumedArm, model: CameraModel, T_base_board: Floats, radius_m: float, q_rad: Floats, rng: np.random.Generator
) -> Iterator[Floats]:
    """Joint readings (joint,) of the nominal tour from `q_rad`; what the arm cannot reach is left out."""
    for T_board_camera in viewpoints(model, radius_m):
        try:
            q_rad = reach(arm, T_base_board @ T_board_camera @ inverse(model.T_flange_camera), q_rad, rng)
        except UnreachableError:
            continue
        yield q_rad


CENTRES = (0.0, 0.0, 0.0, 0.0)
STAND_OFF_M = 0.2  # of the laser from the first face
ROLLS_RAD = (0.0, 0.4, -0.4)  # of the poses with light, each in both orders
GLANCE_S = 0.01
STEADY_S = 0.05  # of the spots that give the beam


@dataclass(frozen=True)
class MeasuredCamera:
    """`calibration.model` is of lens and mount alone; `model` is what to aim by, None unless the beam was found too."""

    stops: int
    views: int
    calibration: Calibration
    model: CameraModel | None = None
    fit: CameraFit | None = None

    @property
    def says(self) -> str:
        """One sentence for a person."""
        fit = self.fit
        if self.calibration.status is not CameraStatus.CALIBRATED:
            return self.calibration.status.value
        if fit is None or fit.beam_m is None or fit.beam_rad is None:
            return "lens and mount were found, but no pose had light on both faces and the board in the picture"
        return (
            f"{self.views} views: corners fit to {fit.reprojection_px:.2f} px, the board stays to "
            f"{1e3 * fit.board_m:.1f} mm and {1e3 * fit.board_rad:.0f} mrad (left by the arm's zeros); the beam before "
            f"the camera, {fit.lit} poses with light, to {1e3 * fit.beam_m:.2f} mm and {1e3 * fit.beam_rad:.1f} mrad"
        )


@dataclass(frozen=True, eq=False)
class Line:
    """The laser's beam before the camera: a point (3,) m where it strikes the first face, and its direction (3,)."""

    point_m: Floats
    direction: Floats


def line_before(T_camera_fixture: Floats, hit_m: Floats, direction: Floats) -> Line:
    """The beam that strikes at `hit_m` (3,), both in the fixture's frame."""
    R = T_camera_fixture[:3, :3]
    return Line(R @ hit_m + T_camera_fixture[:3, 3], R @ direction)


def onto_beam(model: CameraModel, lines: Sequence[Line], arm: AssumedArm) -> tuple[CameraModel, float, float]:
    """The mount turned and shifted as little as brings the mean of `lines` onto the assumed laser; and their scatter:

    rms angle (rad) of the directions, rms distance (m) of the points struck from the mean line.
    """
    direction = np.mean([line.direction for line in lines], axis=0)
    direction /= np.linalg.norm(direction)
    point_m = np.mean([line.point_m for line in lines], axis=0)
    bend = [np.linalg.norm(np.cross(line.direction, direction)) for line in lines]
    off_m = [np.linalg.norm(np.cross(line.point_m - point_m, direction)) for line in lines]
    laser_m, along = laser_in_flange(arm)
    T = model.T_flange_camera.copy()
    turn = Rotation.align_vectors(along[None], (T[:3, :3] @ direction)[None])[0].as_matrix()
    T[:3, :3] = turn @ T[:3, :3]
    away_m = laser_m - (T[:3, :3] @ point_m + T[:3, 3])
    T[:3, 3] += away_m - along * float(along @ away_m)
    return replace(model, T_flange_camera=T), _rms(bend), _rms(off_m)


def _rms(values: Sequence[np.floating]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


class CameraMeasuring:
    """One measurement; the only owner of where the arm stands meanwhile."""

    def __init__(self, bench: Bench, learner: Learner, eye: Eye, camera: Camera, journal: Events) -> None:
        self._bench, self._learner, self._eye, self._journal = bench, learner, eye, journal
        self._board, self._drawn = Board(camera.board), drawn(camera)
        self._on_fixture = transform(camera.board.in_psd1.origin_m, camera.board.in_psd1.rotation_rad)
        self._rng = np.random.default_rng(1)

    def run(self, placement: int) -> MeasuredCamera:
        """Before the fixture at this place. UnreachableError where the board is not seen; NoLightError, DeviceError."""
        q_rad, fixture = self._stand_before(self._learner.T_base_fixture(placement))
        count, views = self._tour(q_rad, fixture)
        calibration = calibrate_camera(views, self._drawn)
        if calibration.model is None:
            return MeasuredCamera(count, len(views), calibration)
        lines = self._lines(self._sight(calibration.model), placement)
        if not lines or calibration.fit is None:
            return MeasuredCamera(count, len(views), calibration)
        model, beam_rad, beam_m = onto_beam(calibration.model, lines, self._learner.arm)
        fit = replace(calibration.fit, lit=len(lines), beam_m=beam_m, beam_rad=beam_rad)
        return MeasuredCamera(count, len(views), calibration, model, fit)

    def _sight(self, model: CameraModel) -> Sight:
        return Sight(self._eye, model, self._board, self._on_fixture)

    def _stand_before(self, T_base_fixture: Floats) -> tuple[Floats, Floats]:
        """Readings (joint,) where the board is seen, the present ones if possible, and the fixture as seen there."""
        arm, sight, q_rad = self._learner.arm, self._sight(self._drawn), self._readings()
        seen = sight.fixture(arm, q_rad, T_base_fixture)
        if seen is None:
            before = BeamTarget(1, CENTRES, STAND_OFF_M, 0.0)
            self._bench.move(
                reach(arm, flange_for(arm, self._learner.optics, T_base_fixture, before), q_rad, self._rng)
            )
            q_rad = self._readings()
            seen = sight.fixture(arm, q_rad, T_base_fixture)
        if seen is None:
            raise UnreachableError(
                "the camera does not see the board from here; check [camera] in_flange and light, or bring the arm in "
                "front of the fixture (calibeam move, jog)"
            )
        return q_rad, seen

    def _tour(self, q_rad: Floats, fixture: Floats) -> tuple[int, list[View]]:
        """Stops that were made, and the views in which the board was seen."""
        arm, count = self._learner.arm, 0
        views: list[View] = []
        for stop_rad in stops(arm, self._drawn, fixture @ self._on_fixture, self._board.radius_m, q_rad, self._rng):
            try:
                self._bench.move(stop_rad)
            except UnreachableError:  # a keep-out box, or a joint's range
                continue
            count += 1
            seen = self._board.find(self._eye.picture())
            if seen is not None:
                views.append(View(seen, flange(arm, self._readings())))
        return count, views

    def _lines(self, sight: Sight, placement: int) -> list[Line]:
        """The beam before the camera at poses with light, both orders."""
        navigator = Navigator(self._bench, self._learner, self._journal, self._readings(), 1, sight)
        lines: list[Line] = []
        for first in (1, 2):
            navigator.find(placement, first, 0.0)
            for roll_rad in ROLLS_RAD:
                try:
                    navigator.visit(BeamTarget(first, CENTRES, STAND_OFF_M, roll_rad), None)
                except (SpotLostError, UnreachableError):
                    continue
                lines += self._line(sight, placement, first)
        return lines

    def _line(self, sight: Sight, placement: int, first: int) -> list[Line]:
        """One, or none where the board is not in the picture or the light has gone."""
        look = self._bench.look(STEADY_S)
        arm = self._learner.arm
        T = sight.before_camera(arm, look.q_rad, self._learner.T_base_fixture(placement))
        if T is None or not all(look.lit(first)):
            return []
        return [line_before(T, *self._learner.optics.line(look.spots_m(), first))]

    def _readings(self) -> Floats:
        return self._bench.look(GLANCE_S).q_rad
