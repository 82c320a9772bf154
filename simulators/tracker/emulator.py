"""A laser tracker or camera that prints the position of its target, in the columns that the rig declares.

It measures the true target of the moving world from where it truly stands, with noise on each axis, mechanisms of
`simulators.defects` included.

What it does not imitate: search for a lost target, beams broken by the arm's own links, warming up, a noise that
grows with the distance, averaging, and every command but start, stop and trigger.
"""

import json
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from simulators.wire import Bench, DeviceClock, SerialPort, TcpPort, UdpPort, Wire

Floats = NDArray[np.float64]
PER_M = {"m": 1.0, "mm": 1e3, "um": 1e6, "in": 1.0 / 0.0254}
DIGITS = {"m": 7, "mm": 4, "um": 1, "in": 6}  # a tenth of a micrometre or finer
PER_S = {"s": 1.0, "ms": 1e3, "us": 1e6}
TIME_DIGITS = {"s": 6, "ms": 3, "us": 0}
ROOM_DEGC = 20.0
NO_TARGET = "NO_TARGET"
LONGEST_REQUEST = 256  # bytes without a line end; more is noise
LONGEST_WAIT = 512  # lines that a wire keeps for a client that is not asked yet
LOOPBACK = "127.0.0.1"


class TargetWorld(Protocol):
    """What it observes."""

    @property
    def time_s(self) -> float: ...

    def target_position_m(self) -> Floats: ...


class Tracker:
    """The instrument; one `Instrument`. Measures at its rate and hands lines to every wire."""

    name = "tracker"

    def __init__(self, world: TargetWorld, device: Mapping[str, Any], noise_m: float, seed: int) -> None:
        self.clock = DeviceClock()
        self.silent = False  # fault: it measures, and prints nothing
        self.sees_target = True
        self._world, self._device, self._noise_m = world, device, noise_m
        self._rng = np.random.default_rng(np.random.SeedSequence([seed, 3]))
        self._period_s = 1.0 / float(device.get("rate_hz", 100.0))
        self._count = 0
        self._begun_s = world.time_s
        self.wires: list[TrackerWire] = []

    def before_step(self, t_s: float) -> None:
        """Nothing: it only looks."""

    def after_step(self, t_s: float) -> None:
        """Prints a line when the next one is due; of several due in one tick, the newest."""
        due = int((self._world.time_s - self._begun_s) / self._period_s + 1e-9)
        if due <= self._count:
            return
        self._count = due
        if any(wire.streams for wire in self.wires) and not self.silent:
            line = self.line()
            for wire in self.wires:
                wire.print(line)

    def line(self) -> bytes:
        """What it measures now, as its output."""
        now_s = self.clock.tells(self._world.time_s)
        seen_m = self._world.target_position_m() + self._noise_m * self._rng.standard_normal(3)
        cells = self._cells(now_s, seen_m)
        text = self._json(cells) if self._device["driver"] == "json-lines" else self._ascii(cells)
        return text.encode() + b"\r\n"

    def _cells(self, now_s: float, seen_m: Floats) -> dict[str, float | str]:
        unit = self._device["length_unit"]
        x, y, z = np.round(seen_m * PER_M[unit], DIGITS[unit]).tolist() if self.sees_target else (0.0, 0.0, 0.0)
        time_unit = self._device.get("time_unit", "s")
        good = next(iter(self._device.get("good", ())), "")
        return {
            "x": x,
            "y": y,
            "z": z,
            "time": round(now_s * PER_S[time_unit], TIME_DIGITS[time_unit]),
            "status": good if self.sees_target else NO_TARGET,
            "temperature": ROOM_DEGC,
            "-": "0",
        }

    def _ascii(self, cells: Mapping[str, float | str]) -> str:
        separator, decimal = self._device.get("separator", ","), self._device.get("decimal", ".")
        texts = [str(cells[name]).replace(".", decimal) if name != "status" else str(cells[name])
                 for name in self._device["columns"]]  # fmt: skip
        return separator.join(texts)

    def _json(self, cells: Mapping[str, float | str]) -> str:
        """Objects within objects, as the paths of the members ask for; a list where all steps are numbers."""
        whole: dict[str, Any] = {}
        for name, path in self._device["members"].items():
            *outer, last = path.split(".")
            place = whole
            for step in outer:
                place = place.setdefault(step, {})
            place[last] = _plain(cells[name]) if name == "status" else cells[name]
        return json.dumps(_lists(whole))


def _plain(status: float | str) -> Any:
    """`true` and `0` of a list of good words as JSON's own values."""
    try:
        return json.loads(str(status))
    except ValueError:
        return status


def _lists(value: Any) -> Any:
    if not isinstance(value, dict):
        return value
    inner: dict[str, Any] = {key: _lists(each) for key, each in value.items()}
    if inner and all(key.isdecimal() for key in inner):
        return [inner.get(str(number), 0.0) for number in range(1 + max(map(int, inner)))]
    return inner


class TrackerWire:
    """One client: lines to it, and its start, stop and trigger. Unknown requests are ignored."""

    def __init__(self, tracker: Tracker, device: Mapping[str, Any]) -> None:
        self._tracker = tracker
        self._start, self._stop, self._trigger = (
            str(device.get(key, "")).strip().encode() for key in ("start", "stop", "trigger")
        )
        self.streams = not (self._start or self._trigger)
        self._heard = b""
        self._waiting: list[bytes] = []

    def print(self, line: bytes) -> None:
        """A line of the stream."""
        if self.streams and len(self._waiting) < LONGEST_WAIT:
            self._waiting.append(line)

    def handle(self, data: bytes) -> bytes:
        *requests, self._heard = (self._heard + data).replace(b"\r", b"\n").split(b"\n")
        self._heard = self._heard[-LONGEST_REQUEST:]
        out = b""
        for request in map(bytes.strip, requests):
            if self._trigger and request == self._trigger and not self._tracker.silent:
                out += self._tracker.line()
            elif self._start and request == self._start:
                self.streams = not self._trigger
            elif self._stop and request == self._stop:
                self.streams = False
        return out

    def due(self) -> bytes:
        waiting, self._waiting = self._waiting, []
        return b"".join(waiting)


def build(world: TargetWorld, rig: Mapping[str, Any]) -> Bench:
    """The instrument of `rig["devices"]["tracker"]` on its TCP port, serial line, or sending UDP.

    Verbs: "tracker.silence" {on} stops its output; "tracker.target" {on} takes the target away, or brings it back.
    """
    device, emulation = rig["devices"]["tracker"], rig.get("emulation", {})
    noise_m = float(emulation.get("position_noise_m", 0.0))
    seed = int(getattr(getattr(world, "truth", None), "seed", emulation.get("seed", 0)))
    tracker = Tracker(world, device, noise_m, seed)

    def accept() -> Wire:
        wire = TrackerWire(tracker, device)
        tracker.wires.append(wire)
        return wire

    def closed(wire: Wire) -> None:
        tracker.wires = [other for other in tracker.wires if other is not wire]

    if "serial_port" in device or "serial_number" in device:
        port = SerialPort("tracker", accept(), device.get("serial_port"))
    elif device.get("transport") == "udp":
        port = UdpPort("tracker", str(device.get("host", LOOPBACK)), int(device["port"]), accept())
    else:
        port = TcpPort("tracker", str(device["host"]), int(device["port"]), accept, closed)
    return Bench([tracker], [port], _verbs(tracker), tracker.clock)


def _verbs(tracker: Tracker) -> dict[str, Callable[..., Any]]:
    def silence(on: bool = True) -> None:
        tracker.silent = on

    def target(on: bool) -> None:
        tracker.sees_target = on

    return {"tracker.silence": silence, "tracker.target": target}
