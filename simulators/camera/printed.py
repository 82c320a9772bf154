"""The printed board as a picture: markers in reading order on white, on a plate of mottled metal.

Markers come from the published dictionaries as OpenCV holds them, as a person would print them.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from simulators.camera.true_camera import BoardDrawing
from simulators.world.errors import WorldError

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
