"""Encoder logging: decoded positions and raw frames, for days, until stopped; a lost bus is attached again."""

import signal
import threading
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import FrameType

from acquisition.frame_log import FrameLog
from acquisition.recording.can_frames import CLASSIC_BYTES, STREAM, channels
from acquisition.recording.rig_schema import EncodersDevice
from acquisition.recording.segments import Rotation, SegmentedRecording, SegmentStream
from acquisition.recording.stream import Channel, Gap
from acquisition.recording.writer import RecordingWriter
from acquisition.reopening import Reopening
from acquisition.streams import Pump
from calibeam.encoders import VIEWED, encoder_driver, identities_of
from calibeam.recorded import ENDING, uninterrupted
from calibeam.software import SOFTWARE
from drivers.clock import Clock
from drivers.device import Block
from drivers.errors import DeviceError

LOOK_S = 0.1  # how often the log looks after itself: the last frames of a quiet bus wait no longer for the disk


@dataclass(frozen=True)
class State:
    """What a log can say of itself."""

    segment: Path
    rows: int  # SYNCs with an answer, over all segments of this run
    frames: int
    error_frames: int
    outages: int
    away: str | None  # why the encoders are away at this moment


class EncoderLog:
    """One run of a log. `run` is called once; it ends by `stopped`, Ctrl-C, or an error, and the file is whole."""

    def __init__(
        self, device: EncodersDevice, rig_text: str, folder: Path, clock: Clock, rotation: Rotation, *, raw: bool
    ) -> None:
        """RecordingError when the folder or the first segment cannot be made."""
        self._clock = clock
        begin = partial(_begin, rig_text=rig_text, clock=clock)
        self._recording = SegmentedRecording(folder, begin, clock, rotation)
        self._frames = self._frame_log() if raw else None
        self._driver = encoder_driver(device, clock, self._frames.hear if self._frames else None)
        self._device = Reopening(self._driver, clock, self._lost, self._back)
        self._stream: SegmentStream | None = None
        self.since_s: float | None = None  # host time from which it runs
        self._rows = self._outages = 0
        self._away: str | None = None
        self.segments: list[Path] = [self._recording.writer.path]

    @property
    def state(self) -> State:
        frames = self._frames
        return State(
            self._recording.writer.path,
            self._rows,
            frames.count if frames else 0,
            frames.errors if frames else 0,
            self._outages,
            self._away,
        )

    def run(self, stopped: Callable[[], bool], tell: Callable[[State], None]) -> None:
        """DeviceError when the encoders are not there at the start, and then nothing is left behind; RecordingError."""
        pump = self._start()
        with _asked_to_end() as asked:
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
                VIEWED,
            )
        except BaseException:
            with uninterrupted():
                self._device.close()
                self._recording.close(complete=False)
                self._recording.writer.path.unlink()
            raise
        self._recording.event("encoders", {"identities": identities_of(self._driver)})
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

    def _frame_log(self) -> FrameLog:
        return FrameLog(self._recording.stream(STREAM, channels(), viewer=()), self._clock, CLASSIC_BYTES)

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

    before = {number: signal.signal(number, ask) for number in ENDING}
    try:
        yield asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _begin(path: Path, notes: Mapping[str, str], *, rig_text: str, clock: Clock) -> RecordingWriter:
    return RecordingWriter(path, rig_text=rig_text, software=SOFTWARE, clock=clock, notes=notes)
