"""Two KPA101 on ports of their own, one for each face of the fixture, with the verbs of the side channel.

A KPA101 holds one detector's three signals as counts, its settings, and the requests it obeys. Messages have six bytes
of header, little endian: identifier; two parameters, or the number of data bytes; destination, with bit 7 when data
follow; source. Source: Thorlabs, APT communications protocol, generic system and quad control messages.
"""

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from simulators.psd_daq.frames import RequestWire, TransmitLine
from simulators.wire import Bench, SerialPort

HOST, GENERIC_USB_UNIT = 0x01, 0x50
DATA_FOLLOWS = 0x80
HEADER_BYTES = 6
LONGEST_DATA = 64  # no request is longer; a longer one is noise


class Id(IntEnum):
    """Messages by name."""

    BLINK = 0x0223
    REQ_INFO = 0x0005
    GET_INFO = 0x0006
    START_UPDATES = 0x0011
    STOP_UPDATES = 0x0012
    RICH_RESPONSE = 0x0081
    QUAD_SET = 0x0870
    QUAD_REQ = 0x0871
    QUAD_GET = 0x0872
    REQ_STATUS = 0x0880
    GET_STATUS = 0x0881
    ACK_STATUS = 0x0882


@dataclass(frozen=True)
class AptRequest:
    """A message for the unit; `data` is empty for a short one, whose parameters are `first` and `second`."""

    id: int
    first: int = 0
    second: int = 0
    data: bytes = b""


class AptRequestReader:
    """Collects bytes; what is not addressed to a USB unit by a host is skipped byte by byte."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def feed(self, data: bytes) -> list[AptRequest]:
        requests: list[AptRequest] = []
        for byte in data:
            self._bytes.append(byte)
            request = self._front()
            if request is not None:
                requests.append(request)
        return requests

    def _front(self) -> AptRequest | None:
        while len(self._bytes) >= HEADER_BYTES:
            number, length, destination, source = struct.unpack_from("<HHBB", self._bytes)
            long = bool(destination & DATA_FOLLOWS)
            if destination & ~DATA_FOLLOWS != GENERIC_USB_UNIT or source != HOST or (long and length > LONGEST_DATA):
                del self._bytes[0]
                continue
            end = HEADER_BYTES + (length if long else 0)
            if len(self._bytes) < end:
                return None
            data = bytes(self._bytes[HEADER_BYTES:end])
            del self._bytes[:end]
            return AptRequest(number, data=data) if long else AptRequest(number, length & 0xFF, length >> 8)
        return None


def message(number: Id, data: bytes) -> bytes:
    return struct.pack("<HHBB", number, len(data), HOST | DATA_FOLLOWS, GENERIC_USB_UNIT) + data


def info(serial_number: int, model: str, firmware: tuple[int, int, int]) -> bytes:
    """84 bytes: serial number, model, type, firmware (minor, interim, major), notes, versions, state, channels."""
    major, interim, minor = firmware
    head = struct.pack("<I8sHBBBx", serial_number, model.encode(), 16, minor, interim, major)
    notes = b"emulated".ljust(60, b"\0")
    return message(Id.GET_INFO, head + notes + struct.pack("<HHH", 1, 0, 1))


def part(number: int, body: bytes) -> bytes:
    """An answer to REQ of sub-message `number`."""
    return message(Id.QUAD_GET, struct.pack("<H", number) + body)


def refusal(request: int, code: int, words: str) -> bytes:
    return message(Id.RICH_RESPONSE, struct.pack("<HH64s", request, code, words.encode()[:63]))


MODEL, FIRMWARE = "KPA101", (1, 0, 7)
PID, READINGS, OUTPUTS, MODE, DISPLAY, MANUAL = 1, 3, 5, 7, 8, 0x0D
MONITOR, OPEN_LOOP, CLOSED_LOOP, AUTO = 1, 2, 3, 4
STATUS_BITS = {MONITOR: 1, OPEN_LOOP: 2, CLOSED_LOOP: 4, AUTO: 4}
NOISE_RATE_HZ = 1000.0  # where the world's noise is stated
UPDATE_S = 0.1  # status updates come ten times a second
UNACKNOWLEDGED_MOST = 50  # updates that nobody acknowledges; then the unit sends no more (APT, HW_START_UPDATEMSGS)
BODY_BYTES = {PID: 6, OUTPUTS: 16, MODE: 2, DISPLAY: 6, MANUAL: 4}
DEFAULTS = {
    PID: struct.pack("<HHH", 16384, 16384, 0),
    OUTPUTS: struct.pack("<hhhhHHhh", -32768, -32768, 32767, 32767, 1, 1, 32767, 32767),
    DISPLAY: struct.pack("<HHH", 128, 1, 0),
    MANUAL: struct.pack("<hh", 0, 0),
}


class PhotocurrentSource(Protocol):
    """What a unit needs of a world."""

    @property
    def time_s(self) -> float: ...

    def psd_rate(self, rate_hz: float) -> None: ...

    def photocurrents_a(self, times_s: NDArray[np.float64]) -> NDArray[np.float64]: ...


class Kpa101Unit:
    """An instrument of `simulators.wire`: reads face `place` (0 or 1) of the world whenever it is asked.

    `x_sign` and `sum_volts` (at 65535 counts) are how this unit is wired: clients disagree about both, so a test sets
    them. Does not imitate: the control loops (closed and auto loop only report that they are on), digital I/O,
    triggers, the 15 kHz of the head, the converter's own noise.
    """

    def __init__(self, world: PhotocurrentSource, place: int, serial_number: int, transimpedance_v_a: float) -> None:
        self.name = f"psd{place + 1}"
        self.x_sign, self.sum_volts = -1, 10.0
        self.silent = False  # fault: obeys and sends nothing
        self.line = TransmitLine(115_200)
        self._world, self._place, self._serial_number = world, place, serial_number
        self._transimpedance_v_a = transimpedance_v_a
        self._settings = dict(DEFAULTS)
        self._mode = MONITOR
        self._next_update_s: float | None = None
        self._unacknowledged = 0
        world.psd_rate(NOISE_RATE_HZ)

    def obey(self, request: AptRequest) -> None:
        answer = self._answer(request)
        if answer:
            self._say(answer)

    def before_step(self, t_s: float) -> None:
        """Nothing: a unit only looks."""

    def after_step(self, t_s: float) -> None:
        """Send the status update that became due, if a client wants them."""
        if self._next_update_s is None or self._world.time_s < self._next_update_s:
            return
        if self._unacknowledged >= UNACKNOWLEDGED_MOST:
            self._next_update_s = None
            return
        self._next_update_s += UPDATE_S
        self._unacknowledged += 1
        self._say(self._status())

    # --- requests

    def _answer(self, request: AptRequest) -> bytes:
        match request.id:
            case Id.REQ_INFO:
                return info(self._serial_number, MODEL, FIRMWARE)
            case Id.QUAD_REQ:
                return self._tell(request.first)
            case Id.QUAD_SET:
                return self._set(request.data)
            case Id.REQ_STATUS:
                return self._status()
            case Id.START_UPDATES:
                self._next_update_s, self._unacknowledged = self._world.time_s + UPDATE_S, 0
            case Id.STOP_UPDATES:
                self._next_update_s = None
            case Id.ACK_STATUS:
                self._unacknowledged = 0
            case _:
                pass  # blink, and what the family knows beyond this unit: no answer
        return b""

    def _tell(self, number: int) -> bytes:
        if number == READINGS:
            return part(READINGS, self._readings())
        if number == MODE:
            return part(MODE, struct.pack("<H", self._mode))
        if number in self._settings:
            return part(number, self._settings[number])
        return refusal(Id.QUAD_REQ, 1, f"no sub-message {number}")

    def _set(self, data: bytes) -> bytes:
        number, body = int.from_bytes(data[:2], "little"), data[2:]
        if len(body) != BODY_BYTES.get(number):
            return refusal(Id.QUAD_SET, 2, f"sub-message {number} of {len(body)} bytes")
        if number != MODE:
            self._settings[number] = body
            return b""
        (mode,) = struct.unpack("<H", body)
        if mode not in STATUS_BITS:
            return refusal(Id.QUAD_SET, 3, f"mode {mode}; 1 to 4 are possible")
        self._mode = mode
        return b""

    # --- signals

    def _readings(self) -> bytes:
        """x, y, sum, x out, y out: ten volts are full scale of the differences and outputs."""
        x, y, total = self._counts()
        x_out, y_out = (x, y) if self._mode == MONITOR else struct.unpack("<hh", self._settings[MANUAL])
        return struct.pack("<hhHhh", x, y, total, x_out, y_out)

    def _counts(self) -> tuple[int, int, int]:
        """Differences and sum of the face, through the head's amplifier and the unit's converter.

        The world speaks of the currents x1, x2, y1, y2 of two layers that carry the photocurrent each; the head of
        differences and sum of one: the photocurrent is the mean of both layers.
        """
        currents_a = self._world.photocurrents_a(np.array([self._world.time_s]))[0]
        left, right, bottom, top = currents_a[4 * self._place : 4 * self._place + 4] * self._transimpedance_v_a
        x = _clipped(self.x_sign * (right - left) / 10.0 * 32767.0, -32768, 32767)
        y = _clipped((top - bottom) / 10.0 * 32767.0, -32768, 32767)
        return x, y, _clipped(0.5 * (left + right + bottom + top) / self.sum_volts * 65535.0, 0, 65535)

    def _status(self) -> bytes:
        return message(Id.GET_STATUS, self._readings() + struct.pack("<I", STATUS_BITS[self._mode]))

    def _say(self, message: bytes) -> None:
        if not self.silent:
            self.line.send(message, self._world.time_s)


class Kpa101Wire(RequestWire[AptRequest]):
    """One connection to a unit. Does not imitate: modem lines, so a client's toggling of RTS is not asked for."""

    def __init__(self, unit: Kpa101Unit, now_s: Callable[[], float]) -> None:
        super().__init__(AptRequestReader().feed, unit.obey, unit.line, now_s)

    def refusal(self, request: bytes) -> bytes | None:
        """For injected faults: the rich response to the first request of these bytes."""
        found = AptRequestReader().feed(request)
        return refusal(found[0].id, 9, "injected refusal") if found else None


def _clipped(value: float, low: int, high: int) -> int:
    return min(high, max(low, round(float(value))))


DEFAULT_SERIAL_NUMBERS = ("69250001", "69250002")  # 69 is the family's prefix
TRANSIMPEDANCE_V_A = 1e5  # Thorlabs PDP90A: 100 kV/A


def build(world: PhotocurrentSource, rig: Mapping[str, Any]) -> Bench:
    """The pair of `rig["devices"]["psd"]`; links are the rig's `ports`, if any.

    Verbs: "psd.silence" {unit, on}; "psd.wiring" {unit, x_sign, sum_full_scale_v} rewires a unit.
    """
    device = rig["devices"]["psd"]
    numbers = device.get("serial_numbers", DEFAULT_SERIAL_NUMBERS)
    links = device.get("ports", (None, None))
    gain = float(device.get("transimpedance_v_a", TRANSIMPEDANCE_V_A))
    units = [Kpa101Unit(world, place, int(numbers[place]), gain) for place in (0, 1)]

    def silence(unit: int, on: bool = True) -> None:
        _one(units, unit).silent = on

    def wiring(unit: int, x_sign: int = -1, sum_full_scale_v: float = 10.0) -> None:
        _one(units, unit).x_sign, _one(units, unit).sum_volts = x_sign, sum_full_scale_v

    ports = [
        SerialPort(unit.name, Kpa101Wire(unit, lambda: world.time_s), link)
        for unit, link in zip(units, links, strict=True)
    ]
    return Bench(units, ports, {"psd.silence": silence, "psd.wiring": wiring})


def _one(units: list[Kpa101Unit], number: int) -> Kpa101Unit:
    if number not in (1, 2):
        raise ValueError(f"unit {number!r}: there are 1 and 2")
    return units[number - 1]
