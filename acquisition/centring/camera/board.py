"""The printed board on the fixture as a camera sees it: its markers in a picture, and from these where the fixture is.

The arm's zeros are wrong by degrees, so this is where the fixture must be assumed to be *for the arm as it stands*:
right for what is near, and taken again after every longer way. OpenCV, of the extra "camera", is loaded where a picture
is read: sessions without a camera do without.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from acquisition.centring.aim import AssumedArm
from acquisition.centring.camera.model import CameraModel
from acquisition.motion.kinematics import apart, flange, inverse
from acquisition.recording.rig.schema import CameraBoard

Grey = NDArray[np.uint8]


class Eye(Protocol):
    """A camera that looks; raises DeviceError, and every call ends."""

    def picture(self) -> Grey:
        """(height, width), taken after the call began: the arm stood when it was made."""
        ...


Floats = NDArray[np.float64]

DICTIONARIES = {"aruco-4x4-50": "DICT_4X4_50", "apriltag-36h11": "DICT_APRILTAG_36h11"}
# Corners are refined within this share of a marker's module, and not nearer to the next edge.
REFINE_MODULES = 0.4


@dataclass(frozen=True, eq=False)
class Seen:
    """Corners of the markers that were found, four each."""

    points_m: Floats  # (corner, 3) in the board's frame
    pixels: Floats  # (corner, 2) to the right and down, middle of the first pixel at 0


class Board:
    """Finds itself in pictures; immutable."""

    def __init__(self, drawing: CameraBoard) -> None:
        """ValueError where the dictionary has no such markers."""
        import cv2

        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, DICTIONARIES[drawing.dictionary]))
        count = drawing.columns * drawing.rows
        if drawing.first_id + count > len(dictionary.bytesList):
            raise ValueError(
                f"[camera.board]: {drawing.dictionary} has markers 0 to {len(dictionary.bytesList) - 1}, the board "
                f"wants up to {drawing.first_id + count - 1}; lower first_id"
            )
        self._corners_m = {drawing.first_id + k: _corners(drawing, k) for k in range(count)}
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        parameters.relativeCornerRefinmentWinSize = REFINE_MODULES
        self._detector = cv2.aruco.ArucoDetector(dictionary, parameters)

    def find(self, picture: Grey) -> Seen | None:
        """None where no marker of the board is in the picture, or one of them twice."""
        corners, ids, _ = self._detector.detectMarkers(picture)
        numbers = [int(number) for number in np.ravel(ids)] if len(corners) else []
        known = [k for k, number in enumerate(numbers) if number in self._corners_m]
        if not known or len({numbers[k] for k in known}) < len(known):
            return None
        points_m = np.concatenate([self._corners_m[numbers[k]] for k in known])
        pixels = np.concatenate([np.asarray(corners[k], dtype=np.float64).reshape(4, 2) for k in known])
        return Seen(points_m, pixels)

    @property
    def radius_m(self) -> float:
        """From the middle to the furthest corner."""
        return float(np.max(np.linalg.norm(np.concatenate(list(self._corners_m.values())), axis=1)))


def _corners(drawing: CameraBoard, number: int) -> Floats:
    """(4, 3) of marker `number` in reading order: from top left, clockwise as seen, which is OpenCV's order."""
    row, column = divmod(number, drawing.columns)
    pitch_m = drawing.side_m + drawing.gap_m
    left = pitch_m * (column - 0.5 * (drawing.columns - 1)) - 0.5 * drawing.side_m
    top = -pitch_m * (row - 0.5 * (drawing.rows - 1)) + 0.5 * drawing.side_m
    right, bottom = left + drawing.side_m, top - drawing.side_m
    return np.array([[left, top, 0.0], [right, top, 0.0], [right, bottom, 0.0], [left, bottom, 0.0]])


# A flat board has two poses that look nearly alike. The second one counts as well while its misfit is less than this
# many times the first one's; then the one nearer to what was assumed is taken.
ALIKE = 2.0
WORST_PX = 2.0  # rms misfit of a corner beyond which something else was taken for the board


def board_poses(model: CameraModel, seen: Seen) -> list[tuple[Floats, float]]:
    """T_camera_board (4, 4) with its rms misfit in pixels, the better one first; empty where there is none.

    Source: T. Collins, A. Bartoli, "Infinitesimal plane-based pose estimation", IJCV 109 (2014) 252; refined by
    Levenberg-Marquardt.
    """
    import cv2

    given = (seen.points_m, seen.pixels, model.matrix_px, model.distortion)
    count, turns, shifts, _ = cv2.solvePnPGeneric(*given, flags=cv2.SOLVEPNP_IPPE)
    found: list[tuple[Floats, float]] = []
    for k in range(count):
        turn, shift = cv2.solvePnPRefineLM(*given, turns[k], shifts[k])
        T = np.eye(4)
        T[:3, :3] = cv2.Rodrigues(turn)[0]
        T[:3, 3] = np.ravel(shift)
        off = cv2.projectPoints(seen.points_m, turn, shift, model.matrix_px, model.distortion)[0].reshape(-1, 2)
        found.append((T, float(np.sqrt(np.mean((off - seen.pixels) ** 2)))))
    ahead = [(T, rms) for T, rms in found if T[2, 3] > 0.0 and rms < WORST_PX]
    return sorted(ahead, key=lambda pair: pair[1])


class Sight:
    """One camera and one board; takes pictures when asked."""

    def __init__(self, eye: Eye, model: CameraModel, board: Board, T_psd1_board: Floats) -> None:
        self._eye, self._model, self._board, self._T_board_psd1 = eye, model, board, inverse(T_psd1_board)

    def fixture(self, arm: AssumedArm, q_rad: Floats, T_base_fixture: Floats) -> Floats | None:
        """T_base_psd1 (4, 4) for the assumed arm, which stands at `q_rad` (joint,); `T_base_fixture`: as assumed.

        None where the board is not in the picture. DeviceError of the camera.
        """
        seen = self.before_camera(arm, q_rad, T_base_fixture)
        return None if seen is None else flange(arm, q_rad) @ self._model.T_flange_camera @ seen

    def sees_board(self) -> bool:
        """Whether the board is in the picture now. DeviceError of the camera."""
        return self._board.find(self._eye.picture()) is not None

    def before_camera(self, arm: AssumedArm, q_rad: Floats, T_base_fixture: Floats) -> Floats | None:
        """T_camera_psd1 (4, 4): of poses that fit alike the one nearer to what is assumed. As `fixture` otherwise."""
        seen = self._board.find(self._eye.picture())
        poses = [] if seen is None else board_poses(self._model, seen)
        if not poses:
            return None
        assumed = inverse(flange(arm, q_rad) @ self._model.T_flange_camera) @ T_base_fixture
        alike = [T @ self._T_board_psd1 for T, rms in poses if rms <= ALIKE * poses[0][1]]
        return min(alike, key=lambda T: apart(T, assumed)[1])
