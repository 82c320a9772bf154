"""The newest reading of every device, and how each device is: live, stale, lost or not yet connected.

The page reads it 30 times a second and never makes a reader thread wait. Health: how fast a device sends, what is
missing, and what to do about it.
"""

import threading
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from msgspec import Struct

from acquisition.recording.rig import Rig
from acquisition.recording.rig.devices import EncoderDriver
from acquisition.wires.psd_view import PsdView
from calibeam.devices.encoders import LEAST_RATE
from calibeam.live.feed import Progress
from calibeam.live.stopping import Stop
from drivers.clock import Clock
from drivers.device import Block

LINES = 200  # of the messages that are kept


@dataclass(frozen=True)
class DeviceReadings:
    """All that is known of one device. `why`: it is lost, and why."""

    block: Block | None = None  # the newest
    samples: int = 0
    lost: int = 0  # samples that the steps of `sequence` miss
    why: str | None = None


@dataclass(frozen=True)
class ReportedLine:
    """A message."""

    number: int
    host_s: float
    text: str


class Latest:
    """Implements Feed. Records are replaced whole, so looking takes no lock; a device has one reader thread."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.also: Callable[[str, Block], None] = lambda device, block: None  # who else hears, after the page
        self.stop = Stop(clock)
        self.view: PsdView | None = None
        self.rig: Rig | None = None  # None: as the page was begun with
        self.standing: tuple[int, int] | None = None  # placement, first_psd
        self.corrections: Mapping[str, float] = {}
        self.where: Progress | None = None
        self.lines: tuple[ReportedLine, ...] = ()
        self._heard: dict[str, DeviceReadings] = {}
        self._speaking = threading.Lock()

    def of(self, device: str) -> DeviceReadings:
        """Empty before anything was heard."""
        return self._heard.get(device, DeviceReadings())

    def heard(self, device: str, block: Block) -> None:
        before = self.of(device)
        count = len(block.host_s)
        self._heard[device] = DeviceReadings(
            block, before.samples + count, before.lost + _missed(before.block, block, count)
        )
        self.also(device, block)

    def lost(self, device: str, why: str) -> None:
        self._heard[device] = replace(self.of(device), why=why)

    def sees(self, view: PsdView) -> None:
        self.view = view

    def measures(self, rig: Rig) -> None:
        self.rig = rig

    def stands(self, placement: int, first_psd: int) -> None:
        self.standing = (placement, first_psd)

    def believes(self, corrections: Mapping[str, float]) -> None:
        self.corrections = corrections

    def progress(self, progress: Progress) -> None:
        self.where = progress

    def said(self, text: str) -> None:
        with self._speaking:
            number = self.lines[-1].number + 1 if self.lines else 1
            self.lines = (*self.lines[1 - LINES :], ReportedLine(number, self.clock.now_s(), text))

    def stops_by(self, stop: Callable[[], None] | None) -> None:
        self.stop.by(stop)


def _missed(before: Block | None, block: Block, count: int) -> int:
    """Samples between the last one heard and the end of this block that never came; none where counting began again."""
    last = int(block.sequence[0]) - 1 if before is None else int(before.sequence[-1])
    return max(0, int(block.sequence[-1]) - last - count)


STALE_S = 0.3  # readers themselves give up after 0.5 s; sooner, a busy machine would make a page flicker
STALE_PERIODS = 5.0  # of a device slower than that
RATE_OVER_S = 2.0


class Health(Struct, frozen=True):
    """One device. `state`: "live", "stale", "lost", "waiting"; `says`: what is wrong and what to do, or nothing."""

    device: str
    state: str
    age_s: float | None
    rate_hz: float | None
    asked_hz: float | None
    lost: int
    says: str


def asked_rates(rig: Rig) -> dict[str, float | None]:
    """The rig's devices and the rates they are asked for (Hz); None: it sends at a pace of its own."""
    psd, encoders, robot = rig.devices.psd, rig.devices.encoders, rig.devices.robot
    rates: dict[str, float | None] = {}
    if robot is not None:
        rates["robot"] = robot.rate_hz
    if psd is not None:
        rates["psd"] = psd.rate_hz
    if rig.devices.tracker is not None:
        rates["tracker"] = rig.devices.tracker.rate_hz
    if encoders is not None:
        rates["encoders"] = encoders.sync_hz if encoders.driver is EncoderDriver.CIA406 else None
    return rates | {other.name: None for other in rig.devices.others}


class Watch:
    """Remembers the last seconds of counts, from which rates come; asked a few times a second, from one thread."""

    def __init__(self, asked_hz: Mapping[str, float | None]) -> None:
        self.asked_hz = dict(asked_hz)
        self._marks: dict[str, deque[tuple[float, float, int]]] = {name: deque() for name in asked_hz}

    def fresh(self, device: str, heard: DeviceReadings, now_s: float) -> bool:
        """Whether its newest sample may be shown as what is."""
        return heard.why is None and heard.block is not None and _age_s(heard, now_s) <= self._limit_s(device)

    def look(self, device: str, heard: DeviceReadings, now_s: float) -> Health:
        """The device now."""
        asked_hz = self.asked_hz.get(device)
        if heard.block is None:
            if heard.why is not None:
                return Health(device, "lost", None, None, asked_hz, heard.lost, heard.why)
            return Health(device, "waiting", None, None, asked_hz, heard.lost, "no sample yet: it is being connected")
        age_s, rate_hz = _age_s(heard, now_s), self._rate(device, heard, now_s)
        if heard.why is not None:
            return Health(device, "lost", age_s, None, asked_hz, heard.lost, heard.why)
        if age_s > self._limit_s(device):
            says = f"no new sample for {age_s:.1f} s: check its cable and power"
            return Health(device, "stale", age_s, None, asked_hz, heard.lost, says)
        return Health(device, "live", age_s, rate_hz, asked_hz, heard.lost, _slow(rate_hz, asked_hz, heard.lost))

    def _limit_s(self, device: str) -> float:
        asked_hz = self.asked_hz.get(device)
        return STALE_S if asked_hz is None else max(STALE_S, STALE_PERIODS / asked_hz)

    def _rate(self, device: str, heard: DeviceReadings, now_s: float) -> float | None:
        """Samples a second of the device's own clock; None until there are two looks to compare."""
        marks = self._marks.setdefault(device, deque())
        assert heard.block is not None  # noqa: S101 - asked by look
        device_s = float(heard.block.device_s[-1])
        if device_s != device_s:  # NaN: it has no clock of its own
            device_s = float(heard.block.host_s[-1])
        if marks and device_s < marks[-1][1]:  # restarted
            marks.clear()
        marks.append((now_s, device_s, heard.samples))
        while now_s - marks[0][0] > RATE_OVER_S and len(marks) > 2:
            marks.popleft()
        span_s = device_s - marks[0][1]
        return (heard.samples - marks[0][2]) / span_s if span_s > 0.0 else None


def _age_s(heard: DeviceReadings, now_s: float) -> float:
    assert heard.block is not None  # noqa: S101 - asked by its callers
    return max(0.0, now_s - float(heard.block.host_s[-1]))


def _slow(rate_hz: float | None, asked_hz: float | None, lost: int) -> str:
    if rate_hz is None or asked_hz is None or rate_hz >= LEAST_RATE * asked_hz:
        return ""
    why = "samples are lost on the way" if lost else "it cannot keep up"
    return f"{rate_hz:.0f} of {asked_hz:.0f} Hz, {why}: lower the rate in the rig file, or free the line"
