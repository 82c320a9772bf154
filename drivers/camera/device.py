"""A camera by OpenCV: a video device by its number, a network camera by its URL, or a picture in a file.

Whatever a camera has in its buffers is of the past. A reader therefore takes every frame as it comes, and `picture`
waits for one that can only be of now. A source that is one picture (.jpg, .png) is opened again each time instead.
"""

import threading
from contextlib import suppress
from typing import Any
from urllib.parse import urlsplit

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.errors import DeviceLost, DeviceRefused, DeviceStale

Grey = NDArray[np.uint8]

OPEN_MS = 5000
FRAME_MS = 2000
PICTURES = (".jpg", ".jpeg", ".png", ".bmp")
WAIT_S = 3.0  # for a frame of now


class Camera:
    """`connect`, then `picture` as often as wanted, then `close`; all end in time."""

    name = "camera"

    def __init__(self, source: int | str, size_px: tuple[int, int], clock: Clock, latency_s: float) -> None:
        """`size_px`: width and height that are asked for, and that every picture must have.

        `latency_s`: from the exposure to the program, at most; what arrives sooner after a question is of before it.
        """
        self._source, self._size_px, self._clock, self._latency_s = source, size_px, clock, latency_s
        self._capture: cv2.VideoCapture | None = None
        self._news = threading.Condition()
        self._newest: tuple[float, Any] | None = None
        self._failed = False
        self._stop = threading.Event()
        self._reader: threading.Thread | None = None

    def connect(self) -> None:
        """DeviceLost where it cannot be opened, DeviceRefused where its pictures have another size."""
        if self._is_picture:
            self._checked(self._one())
            return
        self.close()
        self._stop.clear()
        self._failed, self._newest = False, None
        self._capture = self._opened()
        if isinstance(self._source, int):
            self._capture.set(cv2.CAP_PROP_FRAME_WIDTH, self._size_px[0])
            self._capture.set(cv2.CAP_PROP_FRAME_HEIGHT, self._size_px[1])
        self._reader = threading.Thread(target=self._read, args=(self._capture,), name=self.name, daemon=True)
        self._reader.start()
        try:
            self.picture()
        except BaseException:
            self.close()
            raise

    def picture(self) -> Grey:
        """(height, width) as the camera sees it now. DeviceLost, DeviceStale, DeviceRefused."""
        if self._is_picture:
            return self._checked(self._one())
        if self._reader is None:
            raise DeviceLost(f"{self._where}: not connected; connect it first")
        after_s = self._clock.now_s() + self._latency_s

        def fresh() -> bool:
            return self._failed or (self._newest is not None and self._newest[0] >= after_s)

        with self._news:
            come = self._news.wait_for(fresh, WAIT_S)
            if self._failed:
                raise DeviceLost(f"{self._where}: the pictures ended; check its cable, power and network")
            if not come or self._newest is None:
                raise DeviceStale(f"{self._where}: no picture for {WAIT_S:.0f} s; check that nothing else uses it")
            return self._checked(self._newest[1])

    def close(self) -> None:
        """Safe in every state, and more than once."""
        self._stop.set()
        reader, self._reader = self._reader, None
        if reader is not None:
            reader.join(WAIT_S)
        self._capture = None

    @property
    def _where(self) -> str:
        return f"{self.name} {self._source}"

    @property
    def _is_picture(self) -> bool:
        return isinstance(self._source, str) and urlsplit(self._source).path.lower().endswith(PICTURES)

    def _opened(self) -> cv2.VideoCapture:
        if isinstance(self._source, int):
            capture = cv2.VideoCapture(self._source)
        else:
            patience = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, OPEN_MS, cv2.CAP_PROP_READ_TIMEOUT_MSEC, FRAME_MS]
            capture = cv2.VideoCapture(self._source, cv2.CAP_FFMPEG, patience)
        if not capture.isOpened():
            capture.release()
            raise DeviceLost(f"{self._where}: cannot be opened; check [camera] source, cable and network")
        return capture

    def _one(self) -> Any:
        capture = self._opened()
        good, frame = capture.read()
        capture.release()
        if not good:
            raise DeviceLost(f"{self._where}: no picture comes from it; check [camera] source")
        return frame

    def _read(self, capture: cv2.VideoCapture) -> None:
        while not self._stop.is_set():
            good, frame = capture.read()
            with self._news:
                self._failed = not good
                if good:
                    self._newest = (self._clock.now_s(), frame)
                self._news.notify_all()
            if not good:
                break
        with suppress(cv2.error):
            capture.release()

    def _checked(self, frame: Any) -> Grey:
        grey = frame if frame.ndim == 2 else cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY)
        height, width = grey.shape
        if (width, height) != self._size_px:
            raise DeviceRefused(
                f"{self._where}: pictures of {width} x {height}, [camera]: {self._size_px[0]} x {self._size_px[1]}; "
                "correct width_px and height_px, and measure the camera again (calibeam camera)"
            )
        return np.asarray(grey, dtype=np.uint8)
