"""The camera of a rig, for coarse aim: opened, and its calibration read. OpenCV is loaded only where there is one."""

from collections.abc import Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from acquisition.recording import RigFileError
from acquisition.recording.rig import Camera, Rig
from drivers.clock import Clock

if TYPE_CHECKING:
    from acquisition.centring.camera.board import Sight
    from drivers.camera.device import Camera as CameraDevice


@contextmanager
def camera_sight(rig: Rig, clock: Clock, emulated: Mapping[str, Any] | None = None) -> Generator["Sight | None"]:
    """What a session aims by; None where the rig has no camera. `emulated`: where emulators announced it.

    RigFileError, AcquisitionError without a calibration; DeviceError where no picture comes.
    """
    if rig.camera is None:
        yield None
        return
    from acquisition.centring.camera.board import Board, Sight
    from acquisition.centring.camera.model import read_model
    from acquisition.motion.kinematics import transform

    if rig.camera.calibration is None:
        raise RigFileError(
            f"rig {rig.name}: [camera] has no 'calibration'; measure the camera with `calibeam camera`, and name there "
            "the file that it writes (or take [camera] out: the light is then searched)"
        )
    model = read_model(Path(rig.camera.calibration), rig.camera)
    board = rig.camera.board
    with open_camera(rig.camera, clock, emulated) as eye:
        yield Sight(eye, model, Board(board), transform(board.in_psd1.origin_m, board.in_psd1.rotation_rad))


@contextmanager
def open_camera(camera: Camera, clock: Clock, emulated: Mapping[str, Any] | None = None) -> Generator["CameraDevice"]:
    """The camera itself, connected. DeviceError."""
    from drivers.camera.device import Camera as CameraDevice

    source = camera.source if emulated is None else str(emulated["source"])
    device = CameraDevice(source, (camera.width_px, camera.height_px), clock, camera.latency_s)
    device.connect()
    try:
        yield device
    finally:
        device.close()
