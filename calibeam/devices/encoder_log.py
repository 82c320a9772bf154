"""Logging of encoders (raw frames, too) or a tracker for days, until stopped; what is lost is attached again."""

import gc
import threading
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import FrameType

import can

from acquisition.recording import Channel, Gap, RecordingWriter
from acquisition.recording.mcap import Rotation, SegmentedRecording, SegmentStream
from acquisition.recording.rig.devices import EncodersDevice, TrackerDevice
from acquisition.wires.attaching import Guarded, Reopening
from acquisition.wires.frame_log import FrameLog, frame_stamps
from acquisition.wires.streams import Pump
from calibeam.devices.encoders import VIEWED, encoder_driver, identities_of, names_of
from calibeam.devices.instruments import VIEWED as TRACKER_VIEWED
from calibeam.devices.instruments import tracker_driver
from calibeam.devices.recorder import uninterrupted
from calibeam.outcome import ENDING, heard_by
from calibeam.site_log import SITE_LOG
from calibeam.software import SOFTWARE
from drivers.clock import Clock
from drivers.device import Block, stamps_of
from drivers.errors import DeviceError

YOUNG = 20_000  # objects made and not yet gone, before Python searches for cycles: a block has less than a thousand
LOOK_S = 0.1  # how often the log looks after itself: the last frames of a quiet bus wait no longer for the disk


@dataclass(frozen=True)
class LogState:
    """What a log can report of itself."""

    segment: Path
    rows: int  # SYNCs with an answer, over all segments of this run
    missing: int  # rows that the gaps of the stream state as missing; of an outage that is not known
    gaps: int
    frames: int
    error_frames: int
    outages: int
    away: str | None  # why the encoders are away at this moment


class EncoderLog:
    """One run of a log. `run` is called once; it ends by `stopped`, Ctrl-C, or an error, and the file is whole."""

    def __init__(
        self,
        device: EncodersDevice | TrackerDevice,
        rig_text: str,
        folder: Path,
        clock: Clock,
        rotation: Rotation,
        *,
        raw: bool,
    ) -> None:
        """`raw`: of encoders, also every frame. DeviceRefused for a driver that cannot be made; RecordingError when
        folder or first segment cannot be.
        """
        self._clock = clock
        self._frames: FrameLog | None = None
        if isinstance(device, TrackerDevice):
            self._driver, self._viewed = tracker_driver(device, clock), TRACKER_VIEWED
        else:
            self._driver, self._viewed = encoder_driver(device, clock, self._hear if raw else None), VIEWED
        who = partial(names_of, self._driver)
        self._device = Reopening(Guarded(self._driver), clock, self._lost, self._back, who=who)
        begin = partial(_begin, rig_text=rig_text, clock=clock)
        self._recording = SegmentedRecording(folder, begin, clock, rotation)
        if raw and isinstance(device, EncodersDevice):
            self._frames = FrameLog(
                self._recording, clock, frame_stamps(device.interface, asked=device.stamped_by_adapter)
            )
        self._stream: SegmentStream | None = None
        self.since_s: float | None = None  # host time from which it runs
        self._rows = self._outages = 0
        self._away: str | None = None
        self.segments: list[Path] = [self._recording.writer.path]

    @property
    def state(self) -> LogState:
        frames = self._frames
        return LogState(
            self._recording.writer.path,
            self._rows,
            self._stream.writer.missing if self._stream else 0,
            self._stream.writer.gaps if self._stream else 0,
            frames.count if frames else 0,
            frames.errors if frames else 0,
            self._outages,
            self._away,
        )

    def run(self, stopped: Callable[[], bool], tell: Callable[[LogState], None]) -> None:
        """DeviceError when the encoders are not there at the start, and then nothing is left behind; RecordingError."""
        pump = self._start()
        SITE_LOG.begin(self._recording.folder / f"{self._device.name}.log")
        with _asked_to_end() as asked, _rarely_looking_for_cycles():
            try:
                while not (asked.is_set() or stopped()) and pump.failure is None:
                    self._clock.sleep_s(LOOK_S)
                    self._look_after()
                    tell(self.state)
            finally:
                self._end(pump, complete=pump.failure is None)
        if pump.failure is not None:
            raise pump.failure

    def _start(self) -> Pump:
        try:
            self._device.connect()
            self._stream = self._recording.stream(
                self._device.name,
                tuple(Channel(c.name, c.unit, c.shape, c.full_scale, c.resolution) for c in self._device.describe()),
                self._viewed,
                stamps=stamps_of(self._driver),
            )
        except BaseException:
            with uninterrupted():
                self._device.close()
                self._recording.discard()
            raise
        self._recording.event(self._device.name, {"identities": identities_of(self._driver)})
        pump = Pump(self._device, self._clock, self._keep, lambda failure: None, memory=1)
        pump.start()
        self.since_s = self._clock.now_s()
        return pump

    def _look_after(self) -> None:
        if self._frames is not None:
            self._frames.flush()
        if self._recording.rotate_if_due() is not None:
            self.segments.append(self._recording.writer.path)

    def _end(self, pump: Pump, complete: bool) -> None:
        self._device.give_up()
        pump.stop()
        try:
            if self._frames is not None:
                self._frames.flush()
        finally:
            self._recording.close(complete)

    def _hear(self, messages: Sequence[can.Message], sent: bool) -> None:
        assert self._frames is not None  # noqa: S101 - made before the bus is opened
        self._frames.hear(messages, sent)

    def _keep(self, block: Block) -> None:
        assert self._stream is not None  # noqa: S101 - made before the pump starts
        self._stream.append(block.host_s, block.device_s, block.sequence, block.values)
        self._rows += len(block.host_s)

    def _lost(self, why: DeviceError, host_s: float) -> None:
        self._outages += 1
        self._away = str(why)
        self._recording.event("device lost", {"device": self._device.name, "why": str(why), "host_s": host_s})

    def _back(self, from_s: float, to_s: float) -> None:
        why, self._away = self._away or "lost", None
        assert self._stream is not None  # noqa: S101 - nothing is lost before it was there
        self._stream.gap(Gap(from_s, to_s, -1, why))
        self._recording.event("device back", {"device": self._device.name, "away_s": to_s - from_s})


@contextmanager
def _asked_to_end() -> Generator[threading.Event]:
    """Ctrl-C, or the end of the terminal, is remembered and breaks off nothing: no segment is left half begun."""
    asked = threading.Event()

    def ask(number: int, frame: FrameType | None) -> None:
        asked.set()

    with heard_by(dict.fromkeys(ENDING, ask)):
        yield asked


@contextmanager
def _rarely_looking_for_cycles() -> Generator[None]:
    """Frames and rows are gone within a block and hold no cycles; looking among them was a tenth of the whole work."""
    before = gc.get_threshold()
    gc.set_threshold(YOUNG, *before[1:])
    try:
        yield
    finally:
        gc.set_threshold(*before)


def _begin(path: Path, notes: Mapping[str, str], *, rig_text: str, clock: Clock) -> RecordingWriter:
    return RecordingWriter(path, rig_text=rig_text, software=SOFTWARE, clock=clock, notes=notes)
