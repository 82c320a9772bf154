"""The camera on the flange as a network camera: it looks at the board on the fixture, wherever both stand.

Pictures are taken at the camera's own frame rate of emulated time, while somebody looks, and drawn beside the loop that
serves the other devices. One that takes longer than a frame to draw costs the frames meanwhile, as a busy camera's do.
"""

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Protocol
from urllib.parse import urlsplit

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from simulators.camera.http_wire import PICTURE, HttpWire
from simulators.camera.picture import Renderer
from simulators.camera.true_camera import CameraDeviations, TrueCamera, camera_drawing, draw_camera
from simulators.wire import Bench, TcpPort, Wire

Floats = NDArray[np.float64]

FRAME_S = 0.1  # 10 frames a second: what a small network camera gives at full resolution
JPEG_QUALITY = 90


class SeenWorld(Protocol):
    """What a camera sees of the world."""

    def T_base_flange(self) -> Floats: ...
    def T_base_psd1(self) -> Floats | None: ...


class Eye:
    """The camera itself: pictures of the world as it is now."""

    def __init__(self, world: SeenWorld, rig: Mapping[str, Any], seed: int) -> None:
        drawing = camera_drawing(rig)
        deviations = msgspec.convert(dict(rig.get("emulation", {})), type=CameraDeviations)
        self.camera: TrueCamera = draw_camera(drawing, deviations, seed)
        self._world, self._renderer = world, Renderer(self.camera, drawing.board, seed)

    def scene(self) -> Floats | None:
        """Where the board is before the camera now, (4, 4); None where none stands."""
        fixture = self._world.T_base_psd1()
        if fixture is None:
            return None
        T_base_camera = self._world.T_base_flange() @ self.camera.T_flange_camera
        return np.asarray(np.linalg.solve(T_base_camera, fixture @ self.camera.T_psd1_board), dtype=np.float64)

    def take(self, scene: Floats | None) -> NDArray[np.uint8]:
        """(height, width) grey."""
        return self._renderer.take(scene)


class NetworkCamera:
    """One `Instrument`; frames count from 1."""

    name = "camera"

    def __init__(self, eye: Eye) -> None:
        self._eye = eye
        self._wires: list[HttpWire] = []
        self._draughtsman = ThreadPoolExecutor(1, thread_name_prefix="camera")
        self._drawing: Future[bytes] | None = None
        self._begun = self._done = 0
        self._jpeg = b""
        self._next_s = 0.0

    def accept(self) -> Wire:
        wire = HttpWire(lambda: (self._done, self._jpeg), lambda: self._begun)
        self._wires.append(wire)
        return wire

    def closed(self, wire: Wire) -> None:
        self._wires = [other for other in self._wires if other is not wire]

    def before_step(self, t_s: float) -> None: ...

    def after_step(self, t_s: float) -> None:
        if self._drawing is not None and self._drawing.done():
            self._jpeg, self._drawing = self._drawing.result(), None
            self._done = self._begun
        if self._drawing is None and t_s >= self._next_s and any(wire.wants_frames for wire in self._wires):
            self._next_s = t_s + FRAME_S
            self._begun += 1
            self._drawing = self._draughtsman.submit(self._frame, self._eye.scene())

    def _frame(self, scene: Floats | None) -> bytes:
        quality = [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY]
        return cv2.imencode(".jpg", self._eye.take(scene), quality)[1].tobytes()


def build(world: SeenWorld, rig: Mapping[str, Any], seed: int) -> Bench:
    """Listens where the rig's `source` says, if that is an http address; else on loopback, on any port that is free."""
    camera = NetworkCamera(Eye(world, rig, seed))
    source = rig["camera"].get("source", "")
    parts = urlsplit(source if isinstance(source, str) else "")
    http = parts.scheme == "http" and parts.hostname is not None
    host, port = (parts.hostname or "", parts.port or 80) if http else ("127.0.0.1", 0)
    return Bench((camera,), (TcpPort(camera.name, host, port, camera.accept, camera.closed),))


def url(host: str, port: int) -> str:
    """One picture at a time; a client that wants the stream names it instead."""
    return f"http://{host}:{port}{PICTURE}"
