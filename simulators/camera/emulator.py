"""The camera on the flange as a network camera: motion JPEG, or one picture, of the board on the fixture.

Pictures are taken at the camera's own frame rate of emulated time, while a client is connected, and drawn beside the
loop that serves the other devices. One that takes longer than a frame to draw costs the frames meanwhile, as a busy
camera's do.

    GET /stream.mjpg    multipart/x-mixed-replace, a part for every frame (as network cameras have it; RFC 2046, 5.1)
    GET /image.jpg      one picture, begun after the request

What it does not imitate: passwords, other resolutions, HTTPS, keep-alive, RTSP.
"""

from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Protocol
from urllib.parse import urlsplit

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from simulators.camera.picture import CameraDeviations, Renderer, TrueCamera, camera_drawing, draw_camera
from simulators.wire import Bench, TcpPort, Wire

BOUNDARY = b"frame"
LONGEST_REQUEST_BYTES = 16384
STREAM, PICTURE = "/stream.mjpg", "/image.jpg"


class HttpWire:
    """`newest()` gives the number and the JPEG bytes of the newest frame, number 0 before the first."""

    def __init__(self, newest: Callable[[], tuple[int, bytes]], asked_after: Callable[[], int]) -> None:
        self._newest, self._asked_after = newest, asked_after
        self._request = b""
        self._streams = self._waits = False
        self._sent = 0
        self.closing = False

    @property
    def wants_frames(self) -> bool:
        """Whether somebody fetches what the camera sees."""
        return self._streams or self._waits

    def handle(self, data: bytes) -> bytes:
        if self.closing or self.wants_frames:
            return b""
        self._request += data
        if len(self._request) > LONGEST_REQUEST_BYTES:
            return self._refused(b"431 Request Header Fields Too Large")
        if b"\r\n\r\n" not in self._request:
            return b""
        words = self._request.split(b"\r\n", 1)[0].split()
        if len(words) != 3 or words[0] != b"GET":
            return self._refused(b"405 Method Not Allowed")
        path = words[1].split(b"?", 1)[0].decode("ascii", "replace")
        if path == STREAM:
            self._streams, self._sent = True, self._newest()[0]
            kind = b"multipart/x-mixed-replace; boundary=" + BOUNDARY
            return b"HTTP/1.1 200 OK\r\nConnection: close\r\nContent-Type: " + kind + b"\r\n\r\n"
        if path == PICTURE:
            self._waits, self._sent = True, self._asked_after()
            return b""
        return self._refused(b"404 Not Found")

    def due(self) -> bytes:
        number, jpeg = self._newest()
        if not self.wants_frames or number <= self._sent:
            return b""
        self._sent = number
        head = b"Content-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % len(jpeg)
        if self._streams:
            return b"--" + BOUNDARY + b"\r\n" + head + jpeg + b"\r\n"
        self._waits, self.closing = False, True
        return b"HTTP/1.1 200 OK\r\nConnection: close\r\n" + head + jpeg

    def _refused(self, status: bytes) -> bytes:
        self.closing = True
        return b"HTTP/1.1 " + status + b"\r\nConnection: close\r\nContent-Length: 0\r\n\r\n"


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
    """Listens where the rig's `source` has it, if that is an http address; else on loopback, on any free port."""
    camera = NetworkCamera(Eye(world, rig, seed))
    source = rig["camera"].get("source", "")
    parts = urlsplit(source if isinstance(source, str) else "")
    http = parts.scheme == "http" and parts.hostname is not None
    host, port = (parts.hostname or "", parts.port or 80) if http else ("127.0.0.1", 0)
    return Bench((camera,), (TcpPort(camera.name, host, port, camera.accept, camera.closed),))


def url(host: str, port: int) -> str:
    """One picture at a time; a client that wants the stream names it instead."""
    return f"http://{host}:{port}{PICTURE}"
