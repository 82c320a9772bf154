"""The emulated network camera: what it answers however a request is cut, and that its pictures are of a pinhole."""

import tomllib
from pathlib import Path

import cv2
import numpy as np
import pytest

from simulators.camera.emulator import LONGEST_REQUEST_BYTES, HttpWire, NetworkCamera
from simulators.camera.picture import CameraDeviations, Renderer, camera_drawing, draw_camera
from simulators.errors import WorldError

RIG = tomllib.loads((Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd-camera.toml").read_text())
GET = b"GET %s HTTP/1.1\r\nHost: camera\r\n\r\n"


class Shelf:
    """Frames as they come."""

    def __init__(self) -> None:
        self.number, self.begun, self.jpeg = 0, 0, b""

    def wire(self) -> HttpWire:
        return HttpWire(lambda: (self.number, self.jpeg), lambda: self.begun)


@pytest.mark.parametrize("cut", range(1, len(GET % b"/image.jpg")))
def test_a_request_cut_anywhere_gets_one_picture_begun_after_it(cut: int) -> None:
    shelf, request = Shelf(), GET % b"/image.jpg"
    shelf.number, shelf.begun, shelf.jpeg = 6, 7, b"old"
    wire = shelf.wire()
    assert wire.handle(request[:cut]) + wire.handle(request[cut:]) == b""
    shelf.number, shelf.jpeg = 7, b"begun before"
    assert wire.due() == b""
    shelf.number, shelf.jpeg = 8, b"now"
    assert wire.due().endswith(b"Content-Length: 3\r\n\r\nnow")
    assert wire.closing
    assert wire.due() == b""


def test_a_stream_has_a_part_for_every_frame() -> None:
    shelf = Shelf()
    wire = shelf.wire()
    head = wire.handle(GET % b"/stream.mjpg?fps=5")
    assert b"multipart/x-mixed-replace; boundary=frame" in head
    for number, jpeg in enumerate((b"one", b"three"), start=1):
        shelf.number, shelf.jpeg = number, jpeg
        assert wire.due() == b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n%s\r\n" % (
            len(jpeg),
            jpeg,
        )
        assert wire.due() == b""
    assert not wire.closing


@pytest.mark.parametrize(
    ("request_", "status"),
    [
        (GET % b"/", b"404"),
        (b"POST /image.jpg HTTP/1.1\r\n\r\n", b"405"),
        (b"\x00\xff\r\n\r\n", b"405"),
        (b"x" * (LONGEST_REQUEST_BYTES + 1), b"431"),
    ],
)
def test_what_it_does_not_know_is_refused_and_closed(request_: bytes, status: bytes) -> None:
    wire = Shelf().wire()
    assert wire.handle(request_).startswith(b"HTTP/1.1 " + status)
    assert wire.closing
    assert wire.handle(GET % b"/image.jpg") == b""


def test_nothing_is_drawn_while_nobody_looks() -> None:
    class Counting:
        taken = 0

        def scene(self) -> None:
            self.taken += 1

        def take(self, scene) -> np.ndarray:
            return np.zeros((16, 16), np.uint8)

    eye = Counting()
    camera = NetworkCamera(eye)
    for tick in range(200):
        camera.after_step(0.002 * tick)
    assert eye.taken == 0
    wire = camera.accept()
    wire.handle(GET % b"/image.jpg")
    camera.after_step(1.0)
    assert eye.taken == 1


def drawing_and(**deviations: float):
    drawing = camera_drawing(RIG)
    return drawing, draw_camera(drawing, CameraDeviations(**deviations), seed=4)


def corners_px(picture: np.ndarray) -> np.ndarray:
    """Outer corners of the four markers by a detector that is not ours, in the order of their numbers."""
    found, ids, _ = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)).detectMarkers(
        picture
    )
    return np.array([found[k].reshape(4, 2) for k in np.argsort(ids.ravel())])


def test_without_a_lens_error_a_picture_is_a_pinholes() -> None:
    drawing, camera = drawing_and()
    turn, shift = np.array([np.pi - 0.4, 0.2, 0.1]), np.array([0.03, -0.02, 0.22])
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = cv2.Rodrigues(turn)[0], shift
    seen = corners_px(Renderer(camera, drawing.board, 1).take(T))
    side, pitch = drawing.board.side_m, drawing.board.side_m + drawing.board.gap_m
    first = np.array([-0.5 * pitch - 0.5 * side, 0.5 * pitch + 0.5 * side, 0.0])  # top left of marker 0
    last = -first  # bottom right of marker 3
    matrix = np.array([[camera.focal_px, 0, 480.0], [0, camera.focal_px, 360.0], [0, 0, 1]])
    expected = cv2.projectPoints(np.array([first, last]), turn, shift, matrix, np.zeros(5))[0].reshape(2, 2)
    assert np.abs(seen[0, 0] - expected[0]).max() < 1.0  # whole-pixel detector without refinement
    assert np.abs(seen[3, 2] - expected[1]).max() < 1.0


def test_a_barrel_draws_corners_inwards_and_noise_and_blur_are_there() -> None:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.diag([1.0, -1.0, -1.0]), [0.06, 0.04, 0.2]
    drawing, plain = drawing_and()
    _, bent = drawing_and(camera_barrel=-0.1)
    middle = np.array([480.0, 360.0])
    away = [np.linalg.norm(corners_px(Renderer(c, drawing.board, 1).take(T)) - middle, axis=-1) for c in (plain, bent)]
    assert (away[1] < away[0]).all()
    _, noisy = drawing_and(camera_noise_grey=3.0, camera_blur_px=1.0)
    pictures = [Renderer(noisy, drawing.board, 1), Renderer(plain, drawing.board, 1)]
    one, two = pictures[0].take(T).astype(float), pictures[0].take(T).astype(float)
    assert np.std(one - two) == pytest.approx(3.0 * np.sqrt(2.0), rel=0.1)
    sharp = np.abs(np.diff(pictures[1].take(T).astype(float), axis=1)).max()
    assert np.abs(np.diff(one, axis=1)).max() < sharp


def test_a_board_from_behind_or_behind_the_camera_is_not_seen() -> None:
    drawing, camera = drawing_and()
    renderer = Renderer(camera, drawing.board, 1)
    empty = renderer.take(None)
    behind = np.eye(4)
    behind[2, 3] = 0.2  # its back
    away = np.diag([1.0, -1.0, -1.0, 1.0])
    away[2, 3] = -0.2
    for T in (behind, away):
        np.testing.assert_array_equal(renderer.take(T), empty)


def test_a_camera_section_that_cannot_be_is_named() -> None:
    bad = {**RIG, "camera": {**RIG["camera"], "view_rad": "wide"}}
    with pytest.raises(WorldError, match=r"\[camera\].*view_rad"):
        camera_drawing(bad)
