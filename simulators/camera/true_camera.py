"""What the emulated camera and the board on the fixture truly are: drawn once from the seed.

Each sigma of [emulation] scales a normal number that is drawn whether or not it is zero, as in simulators/world/truth.
"""

from collections.abc import Mapping
from typing import Annotated, Any

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from simulators.errors import WorldError
from simulators.world.rig import Pose, Positive, Sigma

Floats = NDArray[np.float64]


class BoardDrawing(msgspec.Struct, frozen=True):
    """`[camera.board]` of the rig."""

    side_m: Positive
    gap_m: Positive
    in_psd1: Pose
    columns: Annotated[int, msgspec.Meta(ge=1)] = 2
    rows: Annotated[int, msgspec.Meta(ge=1)] = 2
    first_id: Annotated[int, msgspec.Meta(ge=0)] = 0
    dictionary: str = "aruco-4x4-50"


class CameraDrawing(msgspec.Struct, frozen=True):
    """`[camera]` of the rig, without how it is reached."""

    width_px: Annotated[int, msgspec.Meta(ge=16)]
    height_px: Annotated[int, msgspec.Meta(ge=16)]
    view_rad: Positive
    in_flange: Pose
    board: BoardDrawing


class CameraDeviations(msgspec.Struct, frozen=True):
    """Keys of [emulation] that are the camera's."""

    camera_origin_sigma_m: Sigma = 0.0
    camera_rotation_sigma_rad: Sigma = 0.0
    camera_focal_sigma: Sigma = 0.0  # share of the focal length
    camera_centre_sigma_px: Sigma = 0.0
    camera_barrel: float = 0.0  # of the lens, see simulators/camera/picture.py
    camera_blur_px: Sigma = 0.0  # one sigma of the point spread
    camera_noise_grey: Sigma = 0.0  # one sigma of a pixel, of 255
    board_origin_sigma_m: Sigma = 0.0
    board_rotation_sigma_rad: Sigma = 0.0


class TrueCamera(msgspec.Struct, frozen=True):
    """Camera axes: x to the right of the picture, y down, z where it looks."""

    width_px: int
    height_px: int
    focal_px: float
    centre_px: tuple[float, float]
    barrel: float
    blur_px: float
    noise_grey: float
    T_flange_camera: Floats
    T_psd1_board: Floats


def camera_drawing(rig: Mapping[str, Any]) -> CameraDrawing:
    """`rig["camera"]`, checked. WorldError naming the key."""
    try:
        return msgspec.convert(dict(rig["camera"]), type=CameraDrawing)
    except msgspec.ValidationError as error:
        raise WorldError(f"rig file, [camera]: {error}; correct it, or take the section out") from error


def draw_camera(drawing: CameraDrawing, deviations: CameraDeviations, seed: int) -> TrueCamera:
    """The truth of one seed."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, 3]))
    share, centre, camera, board = rng.normal(), rng.normal(size=2), rng.normal(size=(2, 3)), rng.normal(size=(2, 3))
    focal_px = 0.5 * drawing.width_px / np.tan(0.5 * drawing.view_rad)
    shift_px = deviations.camera_centre_sigma_px * centre
    return TrueCamera(
        drawing.width_px,
        drawing.height_px,
        float(focal_px * (1.0 + deviations.camera_focal_sigma * share)),
        (float(0.5 * drawing.width_px + shift_px[0]), float(0.5 * drawing.height_px + shift_px[1])),
        deviations.camera_barrel,
        deviations.camera_blur_px,
        deviations.camera_noise_grey,
        _off(drawing.in_flange, deviations.camera_origin_sigma_m, deviations.camera_rotation_sigma_rad, camera),
        _off(drawing.board.in_psd1, deviations.board_origin_sigma_m, deviations.board_rotation_sigma_rad, board),
    )


def pose_matrix(pose: Pose) -> Floats:
    """(4, 4)."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(pose.rotation_rad).as_matrix()
    T[:3, 3] = pose.origin_m
    return T


def _off(pose: Pose, sigma_m: float, sigma_rad: float, normal: Floats) -> Floats:
    T = pose_matrix(pose)
    T[:3, :3] = T[:3, :3] @ Rotation.from_rotvec(sigma_rad * normal[1]).as_matrix()
    T[:3, 3] += sigma_m * normal[0]
    return T
