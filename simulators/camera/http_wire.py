"""One client of the emulated network camera: motion JPEG, or one picture.

GET /stream.mjpg    multipart/x-mixed-replace, a part for every frame (as network cameras have it; RFC 2046, 5.1)
GET /image.jpg      one picture, begun after the request

What it does not imitate: passwords, other resolutions, HTTPS, keep-alive, RTSP.
"""

from collections.abc import Callable

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
        """Whether somebody looks at what the camera sees."""
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
