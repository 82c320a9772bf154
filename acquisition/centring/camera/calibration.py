"""Lens and mount of the camera from one short tour: the board seen from many sides, the arm's readings beside it.

Lens: Z. Zhang, "A flexible new technique for camera calibration", IEEE PAMI 22 (2000) 1330, by OpenCV.
Mount: `hand_eye`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.centring.camera.board import Seen, board_poses
from acquisition.centring.camera.model import CameraFit, CameraModel
from acquisition.motion.kinematics import inverse, rotation_vector

Floats = NDArray[np.float64]

LEAST_VIEWS = 8
LEAST_TURN_RAD = 0.3  # two turns about axes that stand across each other by less show too little of the mount
WORST_PX = 1.0  # rms: beyond it the lens is no pinhole with a bend, or the drawing of the board is wrong
# What joint zeros wrong by 2 deg leave in the board's place over such a tour, twice: 1 m of arm, postures 30 deg apart.
WORST_M, WORST_RAD = 0.02, 0.06


class CameraStatus(Enum):
    """How a camera calibration ended; the value is the sentence for a person."""

    CALIBRATED = "lens and mount were found"
    TOO_FEW_VIEWS = f"the board was seen in fewer than {LEAST_VIEWS} views; light it, clear the view, come nearer"
    TOO_LITTLE_TURN = (
        "the flange turned about one axis only, which does not determine the camera mount; take views from more sides"
    )
    POOR_LENS = "the corners do not fit a lens; check the board's side_m and gap_m, its flatness, and the focus"
    INCONSISTENT = "the board is in another place in every view; check that it stands still, and the arm's zeros"


@dataclass(frozen=True, eq=False)
class View:
    """The board in one picture, and T_base_flange (4, 4) by the arm's readings."""

    seen: Seen
    T_base_flange: Floats


@dataclass(frozen=True, eq=False)
class Calibration:
    """`model` and `fit` are None unless the status is CALIBRATED, or INCONSISTENT or POOR_LENS for `fit`."""

    status: CameraStatus
    model: CameraModel | None = None
    fit: CameraFit | None = None


def calibrate_camera(views: Sequence[View], start: CameraModel) -> Calibration:
    """`start`: the nominal camera. Never raises for bad views."""
    if len(views) < LEAST_VIEWS:
        return Calibration(CameraStatus.TOO_FEW_VIEWS)
    T_base_flange = np.array([view.T_base_flange for view in views])
    if _turn_rad(T_base_flange) < LEAST_TURN_RAD:
        return Calibration(CameraStatus.TOO_LITTLE_TURN)
    model, reprojection_px = _lens(views, start)
    poses = [board_poses(model, view.seen) for view in views]
    if reprojection_px > WORST_PX or not all(poses):
        return Calibration(CameraStatus.POOR_LENS, fit=CameraFit(len(views), reprojection_px, np.nan, np.nan))
    T_camera_board = np.array([pose[0][0] for pose in poses])
    model = replace(model, T_flange_camera=hand_eye(T_base_flange, T_camera_board))
    board_m, board_rad = _scatter(T_base_flange @ model.T_flange_camera @ T_camera_board)
    fit = CameraFit(len(views), reprojection_px, board_m, board_rad)
    if board_m > WORST_M or board_rad > WORST_RAD:
        return Calibration(CameraStatus.INCONSISTENT, fit=fit)
    return Calibration(CameraStatus.CALIBRATED, model, fit)


def _lens(views: Sequence[View], start: CameraModel) -> tuple[CameraModel, float]:
    """The lens with two radial terms: a board of centimetres does not show more."""
    points = [view.seen.points_m.astype(np.float32) for view in views]
    pixels = [view.seen.pixels.astype(np.float32) for view in views]
    flags = cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_ASPECT_RATIO | cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K3
    rms, matrix, distortion, _, _ = cv2.calibrateCamera(
        points, pixels, start.size_px, start.matrix_px.copy(), start.distortion.copy(), flags=flags
    )
    model = replace(start, matrix_px=np.asarray(matrix), distortion=np.ravel(distortion)[:5].astype(np.float64))
    return model, float(rms) / np.sqrt(2.0)  # OpenCV's is of a point, this of a coordinate


def hand_eye(T_base_flange: Floats, T_camera_board: Floats) -> Floats:
    """T_flange_camera (4, 4), in m, from poses (view, 4, 4) of the flange and of a board that stands still.

    Each pair of views gives A X = X B, with A the motion of the flange and B that of the camera. The rotation is the
    direction that is least changed by the linear system A R - R B = 0 in its nine elements, and the rotation nearest to
    it; the translation is the least-squares solution of (A - 1) t = R t_B - t_A. No logarithm is taken, so half turns
    need no care. ValueError where the flange turned about one axis only: the shift along it would be free.

    Source: N. Andreff, R. Horaud, B. Espiau, "Robot hand-eye calibration using structure-from-motion", Int. J. Robotics
    Research 20 (2001) 228; the equation: Y. Shiu, S. Ahmad, IEEE Trans. Robot. Autom. 5 (1989) 16.
    """
    if (turn_rad := _turn_rad(T_base_flange)) < LEAST_TURN_RAD:
        raise ValueError(
            f"flange: turned {turn_rad:.3f} rad about a second axis, not {LEAST_TURN_RAD}; take views from more sides"
        )
    one, other = np.triu_indices(len(T_base_flange), 1)
    A = inverse(T_base_flange[other]) @ T_base_flange[one]
    B = T_camera_board[other] @ inverse(T_camera_board[one])
    changed = np.einsum("pij,kl->pikjl", A[:, :3, :3], np.eye(3)) - np.einsum("ij,plk->pikjl", np.eye(3), B[:, :3, :3])
    nearly = np.linalg.svd(changed.reshape(-1, 9), full_matrices=False)[2][-1].reshape(3, 3)
    U, _, V = np.linalg.svd(nearly * np.sign(np.linalg.det(nearly)))
    T = np.eye(4)
    T[:3, :3] = U @ np.diag([1.0, 1.0, np.linalg.det(U @ V)]) @ V
    along = B[:, :3, 3] @ T[:3, :3].T - A[:, :3, 3]
    T[:3, 3] = np.linalg.lstsq((A[:, :3, :3] - np.eye(3)).reshape(-1, 3), along.reshape(-1), rcond=None)[0]
    return T


def _turn_rad(T_base_flange: Floats) -> float:
    """The second largest extent of the turns between the flange's postures, as rotation vectors from the first."""
    turns = rotation_vector((inverse(T_base_flange[0]) @ T_base_flange)[:, :3, :3])
    spread = np.linalg.svd(turns - turns.mean(axis=0), compute_uv=False)
    return float(spread[1]) / np.sqrt(len(turns))


def _scatter(T_base_board: Floats) -> tuple[float, float]:
    """Rms distance (m) and turn (rad) of poses (view, 4, 4) from their mean."""
    mean = Rotation.from_matrix(T_base_board[:, :3, :3]).mean()
    off = rotation_vector(mean.as_matrix().T @ T_base_board[:, :3, :3])
    origin_m = T_base_board[:, :3, 3]
    away_m = origin_m - origin_m.mean(axis=0)
    return float(np.sqrt(np.mean(np.sum(away_m**2, axis=1)))), float(np.sqrt(np.mean(np.sum(off**2, axis=1))))
