"""The emulated camera and the board on the fixture as they truly are, and the picture that the camera takes of it.

Each sigma of [emulation] scales a normal number that is drawn once from the seed whether or not it is zero, as in
simulators/world/truth. A picture is made ray by ray, then lens blur, uneven light and sensor noise. The lens distorts
by the division model:

    ideal = distorted / (1 + barrel r^2),  r the distorted radius in focal lengths

Source: A. Fitzgibbon, "Simultaneous linear estimation of multiple view geometry and lens distortion", CVPR 2001. Not
the polynomial that calibrations fit, so that these have something left to fit. Negative: a barrel, as of most lenses.

The printed board: markers in reading order on white, on a plate of mottled metal; markers come from the published
dictionaries as OpenCV holds them, as a person would print them.

What it does not imitate: the fixture's body and the arm in front of the board, motion within the exposure, rolling
shutter, defocus that depends on the distance, glare.
"""

from collections.abc import Mapping
from typing import Annotated, Any

import cv2
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


Singles = NDArray[np.float32]


def slopes(camera: TrueCamera) -> tuple[Singles, Singles]:
    """Right and down (height, width) of the ray through each pixel's middle, per unit of depth."""
    across = (np.arange(camera.width_px) - camera.centre_px[0]) / camera.focal_px
    down = (np.arange(camera.height_px) - camera.centre_px[1]) / camera.focal_px
    x, y = np.meshgrid(across, down)
    widened = 1.0 / (1.0 + camera.barrel * (x * x + y * y))
    return (x * widened).astype(np.float32), (y * widened).astype(np.float32)


Grey = NDArray[np.uint8]

DICTIONARIES = {"aruco-4x4-50": cv2.aruco.DICT_4X4_50, "apriltag-36h11": cv2.aruco.DICT_APRILTAG_36h11}
PX_PER_MARKER = 240
PLATE = 1.7  # of the board's size
METAL_GREY, MOTTLE_GREY = 120.0, 18.0


def board_size_m(board: BoardDrawing) -> tuple[float, float]:
    """Width and height, from outer edge to outer edge of the markers."""
    return (
        board.columns * board.side_m + (board.columns - 1) * board.gap_m,
        board.rows * board.side_m + (board.rows - 1) * board.gap_m,
    )


def printed(board: BoardDrawing) -> tuple[Grey, float]:
    """The plate with the board in its middle, and pixels per metre. WorldError for a dictionary or id unknown."""
    px_per_m = PX_PER_MARKER / board.side_m
    width_m, height_m = board_size_m(board)
    gap_px = round(board.gap_m * px_per_m)
    paper = np.full((round(height_m * px_per_m) + 2 * gap_px, round(width_m * px_per_m) + 2 * gap_px), 255, np.uint8)
    pitch_px = PX_PER_MARKER + gap_px
    for number in range(board.rows * board.columns):
        row, column = divmod(number, board.columns)
        y, x = gap_px + row * pitch_px, gap_px + column * pitch_px
        paper[y : y + PX_PER_MARKER, x : x + PX_PER_MARKER] = _marker(board, board.first_id + number)
    plate = _metal(round(PLATE * paper.shape[0]), round(PLATE * paper.shape[1]))
    top, left = ((np.array(plate.shape) - np.array(paper.shape)) // 2).tolist()
    plate[top : top + paper.shape[0], left : left + paper.shape[1]] = paper
    return plate, px_per_m


def _marker(board: BoardDrawing, number: int) -> Grey:
    name = DICTIONARIES.get(board.dictionary)
    if name is None:
        raise WorldError(
            f'rig file, [camera.board]: dictionary "{board.dictionary}"; known are {", ".join(DICTIONARIES)}'
        )
    dictionary = cv2.aruco.getPredefinedDictionary(name)
    if number >= len(dictionary.bytesList):
        raise WorldError(f"rig file, [camera.board]: marker {number} is none of {board.dictionary}; lower first_id")
    return np.asarray(cv2.aruco.generateImageMarker(dictionary, number, PX_PER_MARKER), dtype=np.uint8)


def _metal(height_px: int, width_px: int) -> Grey:
    """Mottled at a scale of some millimetres, so that thresholds have something to stumble over."""
    rough = np.random.default_rng(1).normal(METAL_GREY, MOTTLE_GREY, (height_px // 12 + 2, width_px // 12 + 2))
    smooth = cv2.resize(rough.astype(np.float32), (width_px, height_px), interpolation=cv2.INTER_CUBIC)
    return np.clip(smooth, 0.0, 255.0).astype(np.uint8)


BLACK_GREY, WHITE_GREY = 28.0, 205.0  # of ink and paper in a well exposed picture
ROOM_GREY, CLUTTER_GREY = 90.0, 25.0  # what is behind the plate
FALL_OFF = 0.25  # of the light from the middle to the corners
NOISE_MARGIN_PX = 64


class Renderer:
    """Pictures of one camera and one board; `take` may run in a thread of its own."""

    def __init__(self, camera: TrueCamera, board: BoardDrawing, seed: int) -> None:
        self._camera = camera
        self._right, self._down = slopes(camera)
        plate, self._px_per_m = printed(board)
        self._plates = [plate]
        while min(self._plates[-1].shape) > 64:
            half = (self._plates[-1].shape[1] // 2, self._plates[-1].shape[0] // 2)
            self._plates.append(np.asarray(cv2.resize(self._plates[-1], half, interpolation=cv2.INTER_AREA), np.uint8))
        rng = np.random.default_rng(np.random.SeedSequence([seed, 4]))
        shape = (camera.height_px, camera.width_px)
        rough = rng.normal(ROOM_GREY, CLUTTER_GREY, (shape[0] // 40 + 2, shape[1] // 40 + 2)).astype(np.float32)
        self._room = np.asarray(cv2.resize(rough, shape[::-1], interpolation=cv2.INTER_CUBIC), dtype=np.float32)
        self._light = (1.0 - FALL_OFF * (self._right**2 + self._down**2)).astype(np.float32)
        extent = (shape[0] + NOISE_MARGIN_PX, shape[1] + NOISE_MARGIN_PX)
        self._noise = rng.normal(0.0, camera.noise_grey, extent).astype(np.float32)
        self._rng = rng

    def take(self, T_camera_board: Floats | None) -> Grey:
        """(height, width); None: no board anywhere. Board axes: x right, y up, z towards who reads it."""
        picture: Singles = self._room.copy()
        if T_camera_board is not None and _faces(T_camera_board):
            self._draw(picture, T_camera_board)
        picture *= self._light
        if self._camera.blur_px > 0.0:
            picture = np.asarray(cv2.GaussianBlur(picture, (0, 0), self._camera.blur_px), dtype=np.float32)
        dy, dx = self._rng.integers(NOISE_MARGIN_PX, size=2)
        picture = picture + self._noise[dy : dy + picture.shape[0], dx : dx + picture.shape[1]]
        return np.clip(np.rint(picture), 0.0, 255.0).astype(np.uint8)

    def _draw(self, picture: Singles, T: Floats) -> None:
        """A ray r meets the board at u, v where u bx + v by + o is along r: three linear forms of r give both."""
        forms = np.linalg.inv(np.column_stack([T[:3, 0], T[:3, 1], T[:3, 3]])).astype(np.float32)
        a, b, c = (form[0] * self._right + form[1] * self._down + form[2] for form in forms)
        ahead = c > 1e-6
        depth = np.where(ahead, c, np.float32(1.0))
        level = self._level(float(np.linalg.norm(T[:3, 3])))
        plate = self._plates[level]
        scale = self._px_per_m / 2.0**level
        across = (a / depth * scale + 0.5 * (plate.shape[1] - 1)).astype(np.float32)
        down = (-b / depth * scale + 0.5 * (plate.shape[0] - 1)).astype(np.float32)
        seen = ahead & (across > 0) & (across < plate.shape[1] - 1) & (down > 0) & (down < plate.shape[0] - 1)
        grey = cv2.remap(plate, across, down, cv2.INTER_LINEAR)
        picture[seen] = BLACK_GREY + (WHITE_GREY - BLACK_GREY) / 255.0 * grey[seen].astype(np.float32)

    def _level(self, distance_m: float) -> int:
        """The plate whose pixels are about as large as the camera's, so that nothing shimmers."""
        shrink = self._px_per_m * distance_m / self._camera.focal_px
        return int(np.clip(np.floor(np.log2(max(shrink, 1.0))), 0, len(self._plates) - 1))


def _faces(T_camera_board: Floats) -> bool:
    """Whether the camera is in front of the board, and the board in front of the camera."""
    origin_m, outwards = T_camera_board[:3, 3], T_camera_board[:3, 2]
    return bool(origin_m[2] > 0.0 and origin_m @ outwards < 0.0)
