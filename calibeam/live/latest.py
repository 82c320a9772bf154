"""The newest of everything that was told, for a page that looks 30 times a second and never makes a reader wait."""

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from acquisition.recording.rig import Rig
from acquisition.wires.psd_view import PsdView
from calibeam.live.feed import Progress
from calibeam.live.stopping import Stop
from drivers.clock import Clock
from drivers.device import Block

LINES = 200  # of what was said that are kept


@dataclass(frozen=True)
class DeviceReadings:
    """All that is known of one device. `why`: it is lost, and why."""

    block: Block | None = None  # the newest
    samples: int = 0
    lost: int = 0  # samples that the steps of `sequence` miss
    why: str | None = None


@dataclass(frozen=True)
class ReportedLine:
    """Something that was said."""

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
    """Samples between the last one heard and the end of this block that never came; none where counting began anew."""
    last = int(block.sequence[0]) - 1 if before is None else int(before.sequence[-1])
    return max(0, int(block.sequence[-1]) - last - count)
