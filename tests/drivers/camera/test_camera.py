"""The camera driver on a real wire: pictures are of now, whatever the source; and how it ends when it cannot."""

import time
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from acquisition.centring.camera.board import Board
from acquisition.recording.rig import load_rig
from calibeam.emulation import Emulation
from drivers.camera.device import Camera
from drivers.clock import SystemClock
from drivers.errors import DeviceError, DeviceLost, DeviceRefused

RIG = Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd-camera.toml"
SIZE = (960, 720)
LATENCY_S = 0.2
MOST_HELD_BACK = 50  # pictures, between a camera and a program that has no time for it
# Readings from which the emulated camera sees the board of seed 1: in front of the first place.
SOURCES = ("image.jpg", "stream.mjpg")


@pytest.fixture(scope="module")
def emulation(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Emulation]:
    """The arm powers on in front of the board: the rig's home is put there."""
    rig = load_rig(RIG)
    text = RIG.read_text().replace("home_rad = [0.3, -1.4, 1.6, -0.5, 0.5, 0.0]", f"home_rad = {before_the_board(rig)}")
    path = tmp_path_factory.mktemp("rig") / "rig.toml"
    path.write_text(text)
    with Emulation(path, time_scale=4.0) as running:
        yield running


def before_the_board(rig) -> list[float]:
    from acquisition.centring.aim import BeamTarget, flange_for, reach
    from calibeam.learner import FittedLearner

    learner = FittedLearner(rig)
    goal = flange_for(
        learner.arm, learner.optics, learner.T_base_fixture(1), BeamTarget(1, (0.0, 0.0, 0.0, 0.0), 0.2, 0.0)
    )
    return reach(learner.arm, goal, np.array(rig.motion.home_rad), np.random.default_rng(1)).tolist()


def source(emulation: Emulation, kind: str) -> str:
    return emulation.address["camera"]["source"].rsplit("/", 1)[0] + "/" + kind


@pytest.mark.parametrize("kind", SOURCES)
def test_an_unmodified_opencv_opens_it(emulation: Emulation, kind: str) -> None:
    capture = cv2.VideoCapture(source(emulation, kind))
    assert capture.isOpened()
    good, frame = capture.read()
    capture.release()
    assert good
    assert frame.shape == (720, 960, 3)


@pytest.mark.parametrize("kind", SOURCES)
def test_a_picture_is_of_now(emulation: Emulation, kind: str) -> None:
    """The fixture is put away and back; the pictures asked for afterwards come to show it so.

    Not the first of them: a busy machine holds pictures back for longer than any latency. What is believed within it
    is tested below, on a line that has a clock of its own.
    """
    camera, board = Camera(source(emulation, kind), SIZE, SystemClock(), LATENCY_S), Board(load_rig(RIG).camera.board)
    camera.connect()
    try:
        for placement in (1, 0, 1, 0, 1):
            emulation.place_fixture(placement)
            asked = (board.find(camera.picture()) is not None for _ in range(MOST_HELD_BACK))
            assert (placement == 1) in asked
    finally:
        camera.close()
        camera.close()


def test_what_was_still_on_its_way_when_it_was_asked_is_not_trusted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Frames come a tenth of a second apart, and are numbered; the camera holds five back."""

    class Line:
        number = 0

        def now_s(self) -> float:
            return 0.1 * self.number

        def read(self) -> tuple[bool, np.ndarray]:
            time.sleep(1e-3)
            self.number += 1
            frame = np.zeros((16, 16), np.uint8)
            frame[0, :2] = self.number // 256, self.number % 256
            return True, frame

        def release(self) -> None: ...

    line = Line()
    monkeypatch.setattr(Camera, "_opened", lambda camera: line)
    camera = Camera("line", (16, 16), line, 0.5)  # type: ignore[arg-type]
    camera.connect()
    asked = line.number
    high, low = camera.picture()[0, :2].tolist()
    camera.close()
    assert 256 * high + low >= asked + 5


def test_pictures_of_another_size_are_refused(emulation: Emulation) -> None:
    camera = Camera(source(emulation, "image.jpg"), (640, 480), SystemClock(), LATENCY_S)
    with pytest.raises(DeviceRefused, match="pictures of 960 x 720"):
        camera.connect()


@pytest.mark.parametrize("kind", ["image.jpg", "nothing.mjpg"])
def test_a_camera_that_is_not_there_is_lost(kind: str) -> None:
    with pytest.raises(DeviceLost, match="cannot be opened"):
        Camera(f"http://127.0.0.1:9/{kind}", SIZE, SystemClock(), LATENCY_S).connect()


def test_a_picture_in_a_file_is_a_camera_too(tmp_path: Path) -> None:
    path = tmp_path / "still.png"
    cv2.imwrite(str(path), np.full((720, 960), 77, np.uint8))
    camera = Camera(str(path), SIZE, SystemClock(), LATENCY_S)
    camera.connect()
    assert camera.picture().mean() == 77.0


def test_a_camera_that_goes_is_said_to_be_lost(tmp_path: Path) -> None:
    with Emulation(RIG) as short:
        camera = Camera(source(short, "stream.mjpg"), SIZE, SystemClock(), LATENCY_S)
        camera.connect()
    with pytest.raises(DeviceError, match="camera http"):
        camera.picture()
    camera.close()
