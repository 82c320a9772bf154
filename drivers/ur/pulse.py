"""Whether a controller's stream is alive, judged by its time stamps, beside ur_rtde and independent of it.

ur_rtde reports "connected" for 2.5 s after the last package, and for ever when the same package comes again and again
(reference: its source, receive thread). Without numpy, because the control child must start quickly.
Source: Universal Robots, "Real-Time Data Exchange (RTDE) Guide", protocol version 2.
"""

import socket
import struct
from collections.abc import Callable

from drivers.clock import Clock, SystemClock
from drivers.errors import DeviceLost, DeviceRefused, DeviceStale

RTDE_PORT = 30004
PULSE_HZ = 25.0
LOOK_S = 0.05
SILENCE_S = 0.4  # ten packages
FIRST_S = 1.0  # from the connection to the first package
HEADER = struct.Struct(">HB")
STAMP = struct.Struct(">Bd")  # recipe, timestamp
DATA, START = ord("U"), ord("S")
GREETING = (
    b"\x00\x05V\x00\x02"
    + HEADER.pack(HEADER.size + 8 + len(b"timestamp"), ord("O")) + struct.pack(">d", PULSE_HZ) + b"timestamp"
    + HEADER.pack(HEADER.size, START)
)  # fmt: skip
READ_BYTES = 65536


class Pulse:
    """A slow stream of its own. A controller that refuses it, or drops it, counts as silent."""

    def __init__(self, host: str, now_s: Callable[[], float], limit_s: float = SILENCE_S) -> None:
        """Sends its requests at once; the answers are read as they come. DeviceLost when nobody is there."""
        self._now_s, self._limit_s = now_s, limit_s
        try:
            self._line = socket.create_connection((host, RTDE_PORT), FIRST_S)
            self._line.sendall(GREETING)
        except OSError as error:
            raise DeviceLost(
                f"robot at {host}:{RTDE_PORT}: {error.strerror or error}; check power and cable"
            ) from error
        self._pending = b""
        self._stamp_s: float | None = None  # the newest
        self._heard_s = self._looked_s = now_s()
        self.refused = False
        self._lost = False

    @property
    def begun(self) -> bool:
        """A first package has come."""
        return self._stamp_s is not None

    def silent(self) -> bool:
        """Whether nothing new came for the limit; costs nothing when asked more often than LOOK_S."""
        now_s = self._now_s()
        if self._lost or now_s - self._looked_s < LOOK_S:
            return self._lost
        self._looked_s = now_s
        self.wait(0.0)
        self._lost = self._lost or now_s - self._heard_s > self._limit_s
        return self._lost

    def wait(self, timeout_s: float) -> None:
        """Reads what comes within the time."""
        try:
            self._line.settimeout(timeout_s)
            data = self._line.recv(READ_BYTES)
        except (BlockingIOError, TimeoutError):
            return
        except OSError:
            data = b""
        self._lost = self._lost or not data
        self._pending += data
        self._take()

    def close(self) -> None:
        self._line.close()

    def _take(self) -> None:
        while len(self._pending) >= HEADER.size:
            size, kind = HEADER.unpack_from(self._pending)
            if size < HEADER.size:
                self._lost = True  # no RTDE any more
                return
            if len(self._pending) < size:
                return
            self._obey(kind, self._pending[HEADER.size : size])
            self._pending = self._pending[size:]

    def _obey(self, kind: int, payload: bytes) -> None:
        if kind == START and payload == b"\x00":
            self.refused = self._lost = True
        if kind == DATA and len(payload) == STAMP.size:
            stamp_s: float = STAMP.unpack(payload)[1]
            if stamp_s != self._stamp_s:
                self._stamp_s, self._heard_s = stamp_s, self._now_s()


def check_stream(host: str, place: str, clock: Clock | None = None) -> None:
    """One package, before anything is built on the stream. DeviceLost, DeviceStale, DeviceRefused."""
    clock = clock or SystemClock()
    pulse = Pulse(host, clock.now_s, FIRST_S)
    try:
        while not pulse.begun:
            pulse.wait(LOOK_S)
            if pulse.refused:
                raise DeviceRefused(f"{place}: the controller refuses a stream; restart it, then connect again")
            if pulse.silent():
                raise DeviceStale(
                    f"{place}: the controller answers on port {RTDE_PORT} but streams nothing; restart it, "
                    "then connect again"
                )
    finally:
        pulse.close()
