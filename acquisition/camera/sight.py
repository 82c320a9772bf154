"""From a picture to where the fixture is: the board's pose before the camera, carried into the base by the arm.

The arm's zeros are wrong by degrees, so this is where the fixture must be believed to be *for the arm as it stands*:
right for what is near, and taken anew after every longer way.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from acquisition.believed import BelievedArm
from acquisition.camera.board import Board, Seen
from acquisition.camera.eye import Eye
from acquisition.camera.model import CameraModel
from acquisition.motion.kinematics import apart, flange, inverse

Floats = NDArray[np.float64]

# A flat board has two poses that look nearly alike. The second one counts as well while its misfit is less than this
# many times the first one's; then the one nearer to what was believed is taken.
ALIKE = 2.0
WORST_PX = 2.0  # rms misfit of a corner beyond which something else was taken for the board


def board_poses(model: CameraModel, seen: Seen) -> list[tuple[Floats, float]]:
    """T_camera_board (4, 4) with its rms misfit in pixels, the better one first; empty where there is none.

    Source: T. Collins, A. Bartoli, "Infinitesimal plane-based pose estimation", IJCV 109 (2014) 252; refined by
    Levenberg-Marquardt.
    """
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

    def fixture(self, arm: BelievedArm, q_rad: Floats, T_base_fixture: Floats) -> Floats | None:
        """T_base_psd1 (4, 4) for the believed arm, which stands at `q_rad` (joint,); `T_base_fixture`: as believed.

        None where the board is not in the picture. DeviceError of the camera.
        """
        seen = self.before_camera(arm, q_rad, T_base_fixture)
        return None if seen is None else flange(arm, q_rad) @ self._model.T_flange_camera @ seen

    def sees_board(self) -> bool:
        """Whether the board is in the picture now. DeviceError of the camera."""
        return self._board.find(self._eye.picture()) is not None

    def before_camera(self, arm: BelievedArm, q_rad: Floats, T_base_fixture: Floats) -> Floats | None:
        """T_camera_psd1 (4, 4): of poses that fit alike the one nearer to what is believed. As `fixture` otherwise."""
        seen = self._board.find(self._eye.picture())
        poses = [] if seen is None else board_poses(self._model, seen)
        if not poses:
            return None
        believed = inverse(flange(arm, q_rad) @ self._model.T_flange_camera) @ T_base_fixture
        alike = [T @ self._T_board_psd1 for T, rms in poses if rms <= ALIKE * poses[0][1]]
        return min(alike, key=lambda T: apart(T, believed)[1])
