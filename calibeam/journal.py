"""Samples and events of a session go into the recording."""

from collections.abc import Mapping
from typing import Any

from acquisition.recording import Event, RecordingWriter
from acquisition.sample import Sample
from drivers.clock import Clock


class RecordingJournal:
    """Implements acquisition.journal.Journal."""

    def __init__(self, writer: RecordingWriter, clock: Clock) -> None:
        self._writer, self._clock = writer, clock

    def sample(self, sample: Sample) -> None:
        self._writer.sample(sample.row(), sample.look.host_s)

    def event(self, kind: str, detail: Mapping[str, Any]) -> None:
        self._writer.event(Event(self._clock.now_s(), kind, detail))
