"""Reports how a session stands to everybody who listens; the owner of what is shown."""

import logging
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from acquisition.recording.rig import Rig
from acquisition.session.control import RunState
from acquisition.session.records import Journal, Phase, Progress, Sample
from calibeam.outcome import PartialResult
from calibeam.sessions.status import UNDELIVERED, Forecast, Listener, Pace, QualityKeeper, SessionStatus
from calibrate.model.arms.rig_arm import limits_of
from drivers.clock import Clock
from drivers.errors import DeviceError

STEPS = ("device check", "plan preview", "confirmation", "measurement", "review", "results")
log = logging.getLogger(__name__)
WORKING = (RunState.RUNNING, RunState.PAUSING, RunState.ENDING)


class StatusReporter:
    """Verbs for every part of a session, from any thread."""

    def __init__(self, rig: Rig, clock: Clock, listeners: Sequence[Listener]) -> None:
        self._keeper = QualityKeeper(*limits_of(rig))
        self._pace, self._listeners = Pace(clock), listeners
        self._turn = threading.RLock()
        self.shown = SessionStatus()

    def step(self, name: str) -> None:
        """A step of the whole job begins."""
        number = STEPS.index(name) + 1
        with self._turn:
            self._now(step=f"{number} of {len(STEPS)}  {name.upper()}")
            self.report(self.shown.step, on_screen=False)  # those who show it see it change

    def report(self, text: str, *, on_screen: bool = True) -> None:
        """One line for a person."""
        log.info("%s", text)
        with self._turn:
            for listener in self._listeners:
                with suppress(OSError):  # a terminal that was closed ends no session
                    listener.report(text, on_screen)

    def progress(self, progress: Progress) -> None:
        """From the session, as `acquisition.session.records.Tell`."""
        with self._turn:
            before = self.shown.progress
            if before is None or (before.placement, before.first) != (progress.placement, progress.first):
                self.report(f"station {progress.placement}, PSD {progress.first} first")
            self._pace.work(progress.phase is not Phase.PLACE and self.shown.state in WORKING)
            self._now(progress=progress, left_s=self._pace.left_s(progress.left))

    def state(self, state: RunState) -> None:
        """From the run control, from several threads: the same one may come twice."""
        with self._turn:
            if state is self.shown.state:
                return
            self._pace.work(state in WORKING)
            self._now(state=state)
            self.report(state.value)

    def ended_early(self, early: PartialResult) -> None:
        """At once, for closing the recording takes a second."""
        self.report(
            f"THE ARM WAS STOPPED: {early}" if isinstance(early.__cause__, DeviceError) else f"ended early: {early}"
        )

    def undelivered(self, trouble: DeviceError | None) -> None:
        """From the run control: the arm could not be stopped; None: now it was, or it need not be."""
        with self._turn:
            self._now(undelivered="" if trouble is None else str(trouble))
            message = "no stop is outstanding any more" if trouble is None else f"{UNDELIVERED.upper()}: {trouble}"
            self.report(message)

    def pausing(self, rests_in_s: float, eased_s: float | None) -> None:
        """From the run control: when the arm rests (s, at most); `eased_s`: braked softly for that, in this time."""
        if eased_s is not None:
            what = f"pause: the arm brakes on its way and stands within {_up(eased_s)} s"
        elif rests_in_s > 0.0:
            what = f"pause: the motion under way ends within {_up(rests_in_s)} s, no other begins"
        else:
            what = "pause: the arm stands, the reading under way is finished"
        self.report(f"{what}; SPACE or Ctrl-C again brakes at once, r goes on")

    def asked(self, text: str) -> None:
        """A person is waited for; "": no more."""
        with self._turn:
            self._pace.work(not text and self.shown.state in WORKING)
            self._now(asked=text)

    def sample(self, sample: Sample) -> None:
        """A pose was taken."""
        with self._turn:
            self._pace.taken()
            quality, progress = self._keeper.add(sample), self.shown.progress
            if progress is not None:
                progress = replace(progress, done=progress.done + 1)
            self._now(
                quality=quality,
                progress=progress,
                left_s=None if progress is None else self._pace.left_s(progress.left),
            )
            self.report(_of_sample(sample, progress), on_screen=False)

    def forecast(self, forecast: Forecast) -> None:
        """From the thread that makes them."""
        with self._turn:
            self._now(forecast=forecast)
            self.report(f"accuracy after pose {forecast.samples}: {forecast.says}", on_screen=False)

    def _now(self, **changed: Any) -> None:
        self.shown = replace(self.shown, **changed)
        for listener in self._listeners:
            with suppress(OSError):
                listener.shows(self.shown)


class ReportingJournal:
    """Implements acquisition.session.records.Journal: what a person has to know of it is reported as well."""

    def __init__(
        self, journal: Journal[Sample], reporter: StatusReporter, took: Callable[[list[Sample]], None]
    ) -> None:
        """`took`: all samples so far, after each."""
        self._journal, self._reporter, self._took = journal, reporter, took
        self.samples: list[Sample] = []

    def sample(self, sample: Sample) -> None:
        self._journal.sample(sample)
        self.samples.append(sample)
        self._reporter.sample(sample)
        self._took(self.samples)

    def event(self, kind: str, detail: Mapping[str, Any]) -> None:
        self._journal.event(kind, detail)
        if kind == "skipped":
            self._reporter.report(f"pose left out at station {detail.get('placement')}: {detail.get('why')}")


def _up(seconds: float) -> str:
    return f"{np.ceil(10.0 * seconds) / 10.0:.1f}"


def _of_sample(sample: Sample, progress: Progress | None) -> str:
    count = "" if progress is None else f" {progress.done} of {progress.total}"
    look = sample.look
    settled = "settled" if look.settled else "NOT settled"
    after = "" if look.settle_s is None else f" in {look.settle_s:.2f} s"
    x1, y1, x2, y2 = (1e3 * look.spots_m()).tolist()
    return (
        f"pose{count}: station {sample.placement}, PSD {sample.first} first, {settled}{after}; spots "
        f"({x1:+z.3f}, {y1:+z.3f}) ({x2:+z.3f}, {y2:+z.3f}) mm"
    )
