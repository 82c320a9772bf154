"""Guided sessions over real wires: an emulated hand obeys, encoders answer over CAN, and every way to end early."""

import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import numpy as np
import pytest
from rich.console import Console

from acquisition.guided.plan import GuidedOptions, GuidedVisit, calibration_plan
from acquisition.guided.reading import BarEnd, Cone
from acquisition.guided.session import GuidedSummary
from acquisition.recording import RecordingWriter, read
from acquisition.recording.rig import load_rig, rig_text
from calibeam.emulation import Emulation
from calibeam.guided.recorded import AssumedGuidedArm, encoder_address, record_guided, watching
from calibeam.guided.run import EmulatedHand, PersonGuide
from calibeam.outcome import PartialResult
from drivers.clock import SystemClock
from simulators.hand.hand_rig import HandTruth

RIG_FILE = Path(__file__).parents[3] / "rigs" / "arm-cmm-reference.toml"
RIG = load_rig(RIG_FILE)
PACE = 10.0
CONES = tuple(GuidedVisit((Cone(seat.id, seat.origin_m),)) for seat in list(RIG.seats.values())[:2] for _ in range(3))
BAR = next(visit for visit in calibration_plan(RIG, GuidedOptions()) if isinstance(visit.targets[0], BarEnd))
PLAN = (*CONES, BAR)


class Takes:
    """Runs the plan over the wires of an emulation; `trouble` is called after so many rows."""

    def __init__(self, emulation: Emulation, path: Path) -> None:
        self.emulation, self.path = emulation, path
        self.trouble: tuple[int, Callable[[], None]] | None = None

    def run(self) -> GuidedSummary:
        clock = SystemClock()
        address = encoder_address(RIG, self.emulation.address["can"], PACE)
        person = PersonGuide(Console(quiet=True))
        with (
            RecordingWriter(self.path, rig_text=rig_text(RIG_FILE), software="test", clock=clock) as writer,
            watching(address, writer, clock) as watch,
        ):
            self._arrange(writer)
            hand = EmulatedHand(self.emulation.ask, person.tell)
            return record_guided(watch, RIG, hand, PLAN, writer, clock, patience_s=30.0)

    def _arrange(self, writer: RecordingWriter) -> None:
        plain, count = writer.sample, [0]

        def counted(*sample) -> None:
            plain(*sample)
            count[0] += 1
            if self.trouble is not None and count[0] == self.trouble[0]:
                self.trouble[1]()

        writer.sample = counted


@pytest.fixture
def takes(tmp_path: Path) -> Iterator[Takes]:
    with Emulation(RIG_FILE, seed=5, time_scale=PACE, truth=tmp_path / "truth.json") as emulation:
        yield Takes(emulation, tmp_path / "recording.mcap")


def test_a_whole_session_is_in_the_recording(takes: Takes, tmp_path: Path) -> None:
    summary = takes.run()
    recording = read(takes.path)
    assert recording.complete
    assert len(recording.samples) == len(summary.readings) == 8
    assert set(recording.streams) == {"encoders"}
    assert recording.samples.integers("seat", 0).tolist() == [1, 1, 1, 2, 2, 2, 0, 0]
    assert recording.samples.columns["bar_end"].tolist()[-2:] == ["a", "b"]
    assert "encoders" in {event.kind for event in recording.events}
    (end,) = (event.detail for event in recording.events if event.kind == "end")
    assert end == {"samples": 8, "slips": summary.slips, "doubted": summary.doubted, "skipped": 0}
    # The arm of this seed is off by millimetres, and so are the cones; a probe in the air would be off by far more.
    written = msgspec.json.decode((tmp_path / "truth.json").read_bytes(), type=HandTruth)
    truth = {seat.id: seat.origin_m for seat in written.seats}
    tips = AssumedGuidedArm.of_rig(RIG).tip_m(recording.samples.joints()[:6])
    apart = np.linalg.norm(tips - [truth[k] for k in (1, 1, 1, 2, 2, 2)], axis=1)
    assert apart.max() < 8e-3


def test_ctrl_c_in_mid_session_keeps_what_was_measured(takes: Takes) -> None:
    takes.trouble = (3, lambda: os.kill(os.getpid(), signal.SIGINT))
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job inherits it ignored
    try:
        with pytest.raises(PartialResult, match=r"Ctrl-C; samples kept in .*: 3;"):
            takes.run()
    finally:
        signal.signal(signal.SIGINT, before)
    assert not read(takes.path).complete
    assert len(read(takes.path).samples) == 3


@pytest.mark.endure  # daily: a lost tracker, test_wired_tracker.py; of the encoders alone, test_device_faults.py
def test_a_lost_encoder_ends_the_session_and_is_named(takes: Takes) -> None:
    takes.trouble = (3, lambda: takes.emulation.ask("encoders.silence", node=3))
    with pytest.raises(PartialResult, match=r"encoder.* 3 .*samples kept in .*: 3;"):
        takes.run()
    assert any(event.kind == "device failed" for event in read(takes.path).events)
    assert len(read(takes.path).samples) == 3
