"""A whole session: for every place and order find the light, centre, collect, repeat; learn the arm on the way."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Bench, Look
from acquisition.camera.sight import Sight
from acquisition.errors import SpotLostError, UnreachableError
from acquisition.journal import Journal
from acquisition.learner import Learner
from acquisition.navigator import Navigator
from acquisition.plan import Block, PlanOptions, Visit, blocks
from acquisition.sample import Sample
from acquisition.servo.centring import Limits
from acquisition.servo.status import Status

Floats = NDArray[np.float64]
Progress = Callable[[int, int, str], None]  # samples taken, samples planned, what is being done

LEARN_EVERY = 5  # samples between refits while the arm is still strange
LEARN_FAST_UNTIL = 30  # after that a refit at the end of every block is enough


@dataclass(frozen=True)
class Summary:
    """What a session brought."""

    samples: tuple[Sample, ...]
    centring_steps: tuple[int, ...]  # motions of every run that reached its tolerance on a centred pose
    skipped: int  # visits without light or out of reach; why is in the journal


class Session:
    """Runs a plan on a bench; the only owner of what was taken. Stopping the arm after an error is the caller's."""

    def __init__(
        self,
        bench: Bench,
        learner: Learner,
        journal: Journal,
        options: PlanOptions,
        home_rad: Floats,
        *,
        limits: Limits | None = None,
        progress: Progress = lambda done, total, text: None,
        sight: Sight | None = None,
    ) -> None:
        self._bench, self._learner, self._journal, self._options = bench, learner, journal, options
        self._navigator = Navigator(bench, learner, journal, home_rad, options.seed, sight)
        self._limits, self._progress = limits or Limits(), progress
        self._samples: list[Sample] = []
        self._steps: list[int] = []
        self._skipped = 0
        self._learned = 0

    @property
    def taken(self) -> int:
        """Samples so far, also after the session was cut short."""
        return len(self._samples)

    def run(self, placements: tuple[int, ...]) -> Summary:
        """Take every block of the plan. DeviceError, NoLightError, UnreachableError, RecordingError end it."""
        plan = tuple(blocks(placements, self._learner.optics.half_size_m, self._options))
        total = sum(len(block.visits) + 2 * self._options.repeats for block in plan)
        self._navigator.move(self._navigator.q_rad)
        standing: int | None = None
        for block in plan:
            if block.placement != standing:
                self._bench.place_fixture(block.placement)
                self._journal.event("placement", {"id": block.placement})
                standing = block.placement
            self._take(block, total)
        return Summary(tuple(self._samples), tuple(self._steps), self._skipped)

    def _take(self, block: Block, total: int) -> None:
        self._navigator.find(block.placement, block.first, block.visits[0].target.roll_rad)
        repeats: list[tuple[Visit, Sample]] = []
        for visit in block.visits:
            self._progress(len(self._samples), total, f"place {block.placement}, PSD {block.first} first")
            sample = self._visit(visit)
            if sample is None:
                self._skipped += 1
            elif visit.repeat is not None:
                repeats.append((visit, sample))
            if len(self._samples) <= LEARN_FAST_UNTIL and len(self._samples) - self._learned >= LEARN_EVERY:
                self._learn()
        for visit, sample in repeats:
            self._again(visit, sample, other_side=False)
            self._again(visit, sample, other_side=True)
        self._learn()
        self._progress(len(self._samples), total, f"place {block.placement}, PSD {block.first} first: done")

    def _visit(self, visit: Visit) -> Sample | None:
        """Go to one pose and record it; None, and said in the journal, where that cannot be done."""
        try:
            run = self._navigator.visit(visit.target, self._limits if visit.centred else None)
        except (UnreachableError, SpotLostError) as why:
            self._journal.event("skipped", {"placement": visit.placement, "why": str(why)})
            return None
        centred = visit.centred and run.status is Status.CENTRED
        if centred:
            self._steps.append(run.steps)
        return self._record(visit, centred=centred)

    def _again(self, visit: Visit, sample: Sample, *, other_side: bool) -> None:
        """The same command again; every joint comes the way it came the first time, or the opposite way."""
        way = sample.approach if other_side else -sample.approach
        self._navigator.move(sample.look.cmd_rad + self._options.opposite_rad * way)
        self._navigator.move(sample.look.cmd_rad)
        self._record(visit, centred=sample.centred)

    def _record(self, visit: Visit, *, centred: bool) -> Sample | None:
        look = self._bench.look(self._options.dwell_s)
        if not usable(look):
            self._journal.event("skipped", {"placement": visit.placement, "why": "no light, or saturated, when read"})
            return None
        approach = self._navigator.approach.copy()
        sample = Sample(look, visit.placement, visit.target.first, approach, visit.repeat, centred)
        self._samples.append(sample)
        self._journal.sample(sample)
        if look.window_s is not None:  # so that the streams tell what happened about the sample
            self._journal.event("sample", {"psd_from_s": look.window_s[0], "psd_to_s": look.window_s[1]})
        return sample

    def _learn(self) -> None:
        self._learner.learn(self._samples)
        self._learned = len(self._samples)
        self._navigator.relearned()


def usable(look: Look) -> bool:
    """Whether both faces have light, and none too much."""
    return all(face.lit and not face.saturated for face in (look.psd1, look.psd2))
