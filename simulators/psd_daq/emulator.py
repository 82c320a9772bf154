"""The PSD DAQ box on its port: amplifiers, converter, sampling clock, requests, and the verbs of the side channel."""

import math
import struct
from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from simulators.psd_daq import frames
from simulators.psd_daq.frames import (
    DEFAULT_BAUD,
    Kind,
    Refusal,
    Request,
    RequestReader,
    RequestWire,
    TransmitLine,
    nak,
)
from simulators.wire import Bench, DeviceClock, SerialPort

MIN_RATE_HZ, MAX_RATE_HZ = 100, 4000
MAX_SAMPLES = 32  # in one frame
FRAMES_PER_S = 100  # the box gathers 10 ms of samples in a frame, as far as they fit
FULL_SCALE_PA = 500_000_000  # 500 uA, where a 2 cm silicon face leaves its straight line (Hamamatsu S1880, 0.5 mA)
TRANSIMPEDANCE_V_A = 20_000  # brings full scale to the 10 V of the converter
DARK_PA = 1_000_000  # photocurrent of a face below 1 uA, 0.2 % of full scale: no light; noise is some nA
FIRMWARE = (1, 0, 0)
MODEL = "emulated dual PSD"
DUO_LATERAL = 1
BODY_BYTES: Mapping[int, int] = {Kind.IDENTIFY: 0, Kind.START: 2, Kind.STOP: 0, Kind.PING: 0}


class LitFaces(Protocol):
    """What the box needs of a world."""

    @property
    def time_s(self) -> float: ...

    @property
    def psd_temperature_degC(self) -> float: ...

    def psd_rate(self, rate_hz: float) -> None: ...

    def photocurrents_a(self, times_s: list[float]) -> NDArray[np.float64]: ...


class PsdDaqBox:
    """An instrument of `simulators.wire`: samples after each physics step, sends whole frames.

    Does not imitate: the converter's own noise (the world's noise is the sum of all), a clock that drifts of itself
    (device time is the world's until somebody disturbs `clock`), a power-on delay.
    """

    name = "psd"

    def __init__(self, world: LitFaces, length_m: float, serial_number: str, line: TransmitLine) -> None:
        """`length_m`: electrode to electrode, of both faces."""
        self.line = line
        self.clock = DeviceClock()
        self.silent = False  # fault: samples are taken and never leave
        self.damaged_frames = 0  # fault: so many of the next data frames get one bit turned
        self._world = world
        self._length_um = round(length_m * 1e6)
        self._serial_number = serial_number
        self._period_ns = 0  # 0: not streaming
        self._next_ns = 0
        self._sequence = 0
        self._samples_per_frame = 1
        self._waiting_ns: list[int] = []
        self._waiting_a: list[NDArray[np.float64]] = []  # converted a frame at a time

    # --- requests

    def obey(self, request: Request) -> None:
        """Answer one request, and do it."""
        answer = self._answer(request)
        if not self.silent:
            self.line.send(answer, self._world.time_s)

    def _answer(self, request: Request) -> bytes:
        if request.version != frames.VERSION:
            return frames.nak(request.kind, Refusal.WRONG_VERSION, f"this box speaks version {frames.VERSION}")
        expected_bytes = BODY_BYTES.get(request.kind)
        if expected_bytes is None:
            return frames.nak(request.kind, Refusal.UNKNOWN_REQUEST, f"no request 0x{request.kind:02X}")
        if len(request.body) != expected_bytes:
            words = f"body of {len(request.body)} bytes, expected {expected_bytes}"
            return frames.nak(request.kind, Refusal.WRONG_LENGTH, words)
        match request.kind:
            case Kind.IDENTIFY:
                return self._identity()
            case Kind.START:
                return self._start(int.from_bytes(request.body, "little"))
            case Kind.STOP:
                self._stop()
                return frames.ack(Kind.STOP)
            case _:
                return frames.ack(request.kind)

    def _identity(self) -> bytes:
        face = struct.pack("<BI", DUO_LATERAL, self._length_um)
        head = struct.pack("<BBBII", *FIRMWARE, FULL_SCALE_PA, TRANSIMPEDANCE_V_A)
        rates = struct.pack("<HH", MIN_RATE_HZ, MAX_RATE_HZ)
        words = frames.text(self._serial_number) + frames.text(MODEL)
        return frames.frame(Kind.IDENTITY, head + face + face + rates + words)

    def _start(self, rate_hz: int) -> bytes:
        if not MIN_RATE_HZ <= rate_hz <= MAX_RATE_HZ:
            words = f"{rate_hz} Hz; {MIN_RATE_HZ} to {MAX_RATE_HZ} Hz are possible"
            return frames.nak(Kind.START, Refusal.RATE_OUT_OF_RANGE, words)
        self._stop()
        self._period_ns = round(1e9 / rate_hz)
        self._next_ns = _nanoseconds(self._world.time_s) + self._period_ns
        self._sequence = 0
        self._samples_per_frame = min(max(rate_hz // FRAMES_PER_S, 1), MAX_SAMPLES)
        self._world.psd_rate(float(rate_hz))
        return frames.ack(Kind.START)

    def _stop(self) -> None:
        self._period_ns = 0
        self._forget()

    # --- sampling

    def before_step(self, t_s: float) -> None:
        """Nothing: a box only looks."""

    def after_step(self, t_s: float) -> None:
        """Take the samples that fell into the step that ended at the world's time, and send full frames."""
        if self._period_ns == 0:
            return
        now_s = self._world.time_s
        count = (_nanoseconds(now_s) - self._next_ns) // self._period_ns + 1
        if count <= 0:
            return
        times_ns = range(self._next_ns, self._next_ns + count * self._period_ns, self._period_ns)
        self._next_ns += count * self._period_ns
        self._waiting_ns += times_ns
        self._waiting_a += list(self._world.photocurrents_a([min(time_ns * 1e-9, now_s) for time_ns in times_ns]))
        while len(self._waiting_ns) >= self._samples_per_frame:
            self._send_frame()

    def _send_frame(self) -> None:
        n = self._samples_per_frame
        first_ns, last_ns = self._waiting_ns[0], self._waiting_ns[n - 1]
        current_pa = _converted_pa(np.array(self._waiting_a[:n]))
        temperature = self._world.psd_temperature_degC
        ahead_us = round((self.clock.tells(first_ns * 1e-9) - first_ns * 1e-9) * 1e6)
        stamp_us = max(0, first_ns // 1000 + ahead_us)
        encoded = frames.data(self._sequence, stamp_us, self._period_ns, temperature, current_pa, _flags(current_pa))
        self._sequence += n
        del self._waiting_ns[:n], self._waiting_a[:n]
        if self.silent:
            return
        if self.damaged_frames > 0:
            self.damaged_frames -= 1
            encoded = _turn_a_bit(encoded)
        self.line.send(encoded, last_ns * 1e-9)

    def _forget(self) -> None:
        self._waiting_ns.clear()
        self._waiting_a.clear()


def _converted_pa(current_a: NDArray[np.float64]) -> NDArray[np.int32]:
    """Whole picoamperes, which end at full scale; same shape."""
    return np.clip(np.rint(current_a * 1e12), -FULL_SCALE_PA, FULL_SCALE_PA).astype(np.int32)


def _flags(current_pa: NDArray[np.int32]) -> NDArray[np.uint16]:
    """Bits 0, 1: a current of face 1, 2 at full scale; bits 2, 3: no light on face 1, 2. (sample, 8) to (sample,)."""
    faces = current_pa.reshape(-1, 2, 4)
    saturated = (np.abs(faces) >= FULL_SCALE_PA).any(axis=2)
    dark = faces.sum(axis=2, dtype=np.int64) < 2 * DARK_PA  # x and y layer each carry the photocurrent
    return (saturated @ np.array([1, 2]) + dark @ np.array([4, 8])).astype(np.uint16)


def _nanoseconds(time_s: float) -> int:
    return math.floor(time_s * 1e9 + 0.5)


def _turn_a_bit(encoded: bytes) -> bytes:
    """One bit of a byte in the middle turned, without making a delimiter."""
    at = len(encoded) // 2
    turned = encoded[at] ^ 0x10 or encoded[at] ^ 0x20
    return encoded[:at] + bytes((turned,)) + encoded[at + 1 :]


class PsdDaqWire(RequestWire[Request]):
    """Bytes to requests, and what has left the line to bytes.

    Does not imitate: baud rate (a pseudo-terminal has none, any setting works), modem lines, break, parity errors; the
    time that requests take on their way in.
    """

    def __init__(self, box: PsdDaqBox, world: LitFaces) -> None:
        super().__init__(RequestReader().feed, box.obey, box.line, lambda: world.time_s)

    def refusal(self, request: bytes) -> bytes | None:
        """For injected faults: the box does not take a request that it knows."""
        requests = RequestReader().feed(request)
        return nak(requests[0].kind, Refusal.UNKNOWN_REQUEST, "injected fault") if requests else None


DEFAULT_SERIAL_NUMBER = "CB-0001"


def build(world: LitFaces, rig: Mapping[str, Any], baud: int = DEFAULT_BAUD) -> Bench:
    """The box of `rig["devices"]["psd"]` with the faces of `rig["fixture"]`; its link is the rig's port, if any.

    Verbs: "psd.silence" {on} stops all that it sends while sampling goes on; "psd.damage" {frames} turns one bit in
    each of the next so many data frames.
    """
    device = rig["devices"]["psd"]
    serial_number = str(device.get("serial_number", DEFAULT_SERIAL_NUMBER))
    box = PsdDaqBox(world, 2.0 * float(rig["fixture"]["half_size_m"]), serial_number, TransmitLine(baud))

    def silence(on: bool = True) -> None:
        box.silent = on

    def damage(frames: int = 1) -> None:
        box.damaged_frames = frames

    port = SerialPort("psd", PsdDaqWire(box, world), device.get("port"))
    return Bench((box,), (port,), {"psd.silence": silence, "psd.damage": damage}, box.clock)
