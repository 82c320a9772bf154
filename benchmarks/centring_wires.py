"""Centring on wires at 500 Hz and the pace of real time: motions and seconds a pose, from arriving to 5 um.

The session's own navigator and servo, one place of the fixture, both orders, every pose centred. What counts is what a
person waits for once the arm has come to a pose: looks, steps, settling. Needs a quiet machine.
"""

import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Bench, Look
from acquisition.centring.loop import CentringStatus, Limits
from acquisition.recording import RecordingWriter
from acquisition.recording.rig import load_rig, rig_text
from acquisition.session.plan import PlanOptions
from acquisition.session.records import Sample
from acquisition.session.session import Session
from calibeam.devices.site import addresses_of, connected
from calibeam.emulation import Emulation
from calibeam.learner import FittedLearner
from drivers.clock import Clock, SystemClock

Floats = NDArray[np.float64]

ALL_CENTRED = PlanOptions(centred=9, off_centre=0, repeats=0)
FIRST_FIVE = 5


class Timed:
    """A bench that writes down when each look and motion began and ended."""

    def __init__(self, bench: Bench, clock: Clock) -> None:
        self._bench, self._clock = bench, clock
        self.calls: list[tuple[float, float]] = []

    def move(self, q_rad: Floats) -> None:
        begin_s = self._clock.now_s()
        self._bench.move(q_rad)
        self.calls.append((begin_s, self._clock.now_s()))

    def look(self, dwell_s: float) -> Look:
        begin_s = self._clock.now_s()
        look = self._bench.look(dwell_s)
        self.calls.append((begin_s, self._clock.now_s()))
        return look

    def place_fixture(self, placement: int) -> None:
        self._bench.place_fixture(placement)

    def stop(self) -> None:
        self._bench.stop()


@dataclass(frozen=True)
class Run:
    """One centring to the tolerance."""

    motions: int
    seconds: float


class RunsJournal:
    """Keeps the runs to 5 um; each ends as it is told."""

    def __init__(self, bench: Timed) -> None:
        self._bench = bench
        self.runs: list[Run] = []
        self.failed: list[str] = []

    def sample(self, sample: Sample) -> None: ...

    def event(self, kind: str, detail: Mapping[str, Any]) -> None:
        if kind != "centring" or detail["tolerance_m"] > Limits().tolerance_m:
            return
        if detail["status"] != CentringStatus.CENTRED.name:
            self.failed.append(detail["status"])
            return
        motions = len(detail["purpose"]) - 1
        calls = self._bench.calls[-(2 * motions + 1) :]  # the first look, then a motion and a look for each step
        self.runs.append(Run(motions, calls[-1][1] - calls[0][0]))


def run(rig_file: Path, seed: int = 1) -> tuple[list[Run], list[str]]:
    """Runs in the order of the session, and how those ended that were not centred."""
    rig, clock = load_rig(rig_file), SystemClock()
    with (
        tempfile.TemporaryDirectory() as folder,
        Emulation(rig_file, seed=seed) as emulation,
        RecordingWriter(
            Path(folder) / "recording.mcap", rig_text=rig_text(rig_file), software="benchmark", clock=clock
        ) as writer,
        connected(rig, addresses_of(rig, emulation.address), writer, clock, emulation.place_fixture) as bench,
    ):
        timed = Timed(bench, clock)
        journal = RunsJournal(timed)
        limits = Limits(step_rad=rig.motion.step_limit_rad)
        home_rad = np.array(rig.motion.home_rad)
        session = Session(timed, FittedLearner(rig), journal, ALL_CENTRED, home_rad, limits=limits)
        session.run(tuple(rig.placements)[:1])
    return journal.runs, journal.failed


def lines(rig_file: Path, seeds: tuple[int, ...] = (1, 2)) -> Iterator[str]:
    for seed in seeds:
        runs, failed = run(rig_file, seed)
        later = runs[FIRST_FIVE:]
        seconds, motions = [r.seconds for r in later], [r.motions for r in later]
        yield (
            f"seed {seed}: {len(runs)} poses to 5 um ({', '.join(failed) or 'none failed'}); after the first five "
            f"{np.median(motions):.0f} motions (p90 {np.percentile(motions, 90):.0f}, max {max(motions)}), "
            f"{np.median(seconds):.2f} s (p90 {np.percentile(seconds, 90):.2f}, max {max(seconds):.2f}) median a pose"
        )
