"""The printed board on the fixture: its markers in a picture, each with the points that belong to its corners."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from acquisition.camera.eye import Grey
from acquisition.recording.rig.schema import CameraBoard

Floats = NDArray[np.float64]

DICTIONARIES = {"aruco-4x4-50": cv2.aruco.DICT_4X4_50, "apriltag-36h11": cv2.aruco.DICT_APRILTAG_36h11}
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
        dictionary = cv2.aruco.getPredefinedDictionary(DICTIONARIES[drawing.dictionary])
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
    """(4, 3) of marker `number` in reading order: from top left, clockwise as seen, which is how OpenCV tells them."""
    row, column = divmod(number, drawing.columns)
    pitch_m = drawing.side_m + drawing.gap_m
    left = pitch_m * (column - 0.5 * (drawing.columns - 1)) - 0.5 * drawing.side_m
    top = -pitch_m * (row - 0.5 * (drawing.rows - 1)) + 0.5 * drawing.side_m
    right, bottom = left + drawing.side_m, top - drawing.side_m
    return np.array([[left, top, 0.0], [right, top, 0.0], [right, bottom, 0.0], [left, bottom, 0.0]])
