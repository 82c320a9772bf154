"""A whole session: for every place and order find the light, centre, collect, repeat; learn the arm on the way.

Between two poses it can be paused, and a pose that was broken off is taken again; what an earlier part of the same
session has taken is not taken twice.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Bench, Look
from acquisition.centring.camera.board import Sight
from acquisition.centring.loop import CentringStatus, Limits
from acquisition.centring.navigator import Navigator
from acquisition.errors import SpotLostError, UnreachableError
from acquisition.session.control import EndedEarlyError, RunControl, RunEvent
from acquisition.session.plan import Block, PlanOptions, PoseKey, Visit, blocks
from acquisition.session.records import Journal, Learner, Phase, Progress, Sample, Tell, key_detail, silent
from acquisition.session.stepping import InterruptibleBench, Stepping

Floats = NDArray[np.float64]
Taken = Mapping[PoseKey, Sample]

LEARN_EVERY = 5  # samples between refits while the arm is still strange
LEARN_FAST_UNTIL = 30  # after that a refit at the end of every block is enough
NOTHING: Taken = {}


@dataclass(frozen=True)
class Summary:
    """What a session brought."""

    samples: tuple[Sample, ...]
    centring_steps: tuple[int, ...]  # motions of every run that reached its tolerance on a centred pose
    skipped: int  # visits without light or out of reach; why is in the journal


class Session:
    """Runs a plan on a bench; the only owner of what was taken. Stopping the arm after an error is the caller's.

    `earlier`: what other parts of this session have taken; the arm is known from it, and it is not taken again.
    """

    def __init__(
        self,
        bench: Bench,
        learner: Learner,
        journal: Journal,
        options: PlanOptions,
        home_rad: Floats,
        *,
        limits: Limits | None = None,
        tell: Tell = silent,
        sight: Sight | None = None,
        control: RunControl | None = None,
        earlier: Taken = NOTHING,
    ) -> None:
        self._control = control or RunControl(bench.stop)
        self._bench = InterruptibleBench(bench, self._control)
        self._learner, self._journal, self._options = learner, journal, options
        self._navigator = Navigator(self._bench, learner, journal, home_rad, options.seed, sight, options.centring)
        self._stepping = Stepping(self._control, self._bench, self._navigator, self._astray)
        self._limits, self._tell, self._earlier = limits or Limits(), tell, earlier
        self._samples: list[Sample] = []
        self._keys: dict[PoseKey, Sample] = {}
        self._steps: list[int] = []
        self._skipped = self._learned = self._total = self._before = 0
        self._standing: int | None = None
        self._lit: tuple[int, int] | None = None  # place and order at which the light is found

    @property
    def taken(self) -> int:
        """Samples so far, also after the session was cut short."""
        return len(self._samples)

    def run(self, placements: tuple[int, ...]) -> Summary:
        """Take every block of the plan. DeviceError, NoLightError, UnreachableError, RecordingError end it."""
        return self.take(tuple(blocks(placements, self._learner.optics.half_size_m, self._options)))

    def take(self, plan: Sequence[Block], standing: int | None = None) -> Summary:
        """Take these blocks, and after them perhaps others; `standing`: the place where the fixture is already."""
        self._standing = self._standing if standing is None else standing
        keys = [key for block in plan for key in block.pose_keys()]
        self._total += len(keys)
        self._before += sum(key in self._earlier for key in keys)
        self._control.tell(RunEvent.START)
        try:
            self._stepping.step(lambda: self._navigator.move(self._navigator.q_rad))
            if self._earlier and not self._samples:
                self._learner.learn(list(self._earlier.values()))
            for block in plan:
                self._take(block)
        except EndedEarlyError:
            self._journal.event("ended by a person", {"samples": self.taken})
        self._control.finish()
        return Summary(tuple(self._samples), tuple(self._steps), self._skipped)

    def _take(self, block: Block) -> None:
        if all(key in self._earlier for key in block.pose_keys()):
            return
        if block.placement != self._standing:
            self._say(Phase.PLACE, block)
            self._bench.place_fixture(block.placement)
            self._journal.event("placement", {"id": block.placement})
            self._standing = block.placement
        for visit in block.visits:
            if visit.key() not in self._earlier:
                self._visit_and_learn(block, visit)
        for visit in block.visits:
            if visit.repeat is not None:
                self._repeat(block, visit)
        self._learn()

    def _visit_and_learn(self, block: Block, visit: Visit) -> None:
        sample = self._stepping.step(partial(self._visit, block, visit))
        if sample is None:
            self._skipped += 1
            self._total -= 2 if visit.repeat is not None else 0  # which cannot be taken again
        known = len(self._earlier) + len(self._samples)
        if known <= LEARN_FAST_UNTIL and len(self._samples) - self._learned >= LEARN_EVERY:
            self._learn()

    def _repeat(self, block: Block, visit: Visit) -> None:
        sample = self._keys.get(visit.key()) or self._earlier.get(visit.key())
        for again in (1, 2):
            if sample is not None and visit.key(again) not in self._earlier:
                self._stepping.step(partial(self._again, block, visit, sample, again))

    def _visit(self, block: Block, visit: Visit) -> Sample | None:
        """Go to one pose and record it; None, and noted in the journal, where that cannot be done."""
        if self._lit != (block.placement, block.first):
            self._say(Phase.AIM, block)
            self._navigator.find(block.placement, block.first, block.visits[0].target.roll_rad)
            self._lit = (block.placement, block.first)
        self._say(Phase.CENTRE if visit.centred else Phase.COLLECT, block)
        try:
            run = self._navigator.visit(visit.target, self._limits if visit.centred else None)
        except (UnreachableError, SpotLostError) as why:
            self._journal.event("skipped", {"placement": visit.placement, "why": str(why)})
            return None
        centred = visit.centred and run.status is CentringStatus.CENTRED
        sample = self._record(visit, visit.key(), centred=centred)
        if centred:
            self._steps.append(run.steps)
        return sample

    def _again(self, block: Block, visit: Visit, sample: Sample, again: int) -> None:
        """The same command again; every joint comes the way it came the first time, or the opposite way."""
        self._say(Phase.REPEAT, block)
        way = -sample.approach if again == 1 else sample.approach
        try:
            self._navigator.move(sample.look.cmd_rad + self._options.opposite_rad * way)
            self._navigator.move(sample.look.cmd_rad)
        except UnreachableError as why:  # the pose was had, but not every way to it is free
            self._journal.event("skipped", {"placement": visit.placement, "why": str(why)})
            self._skipped += 1
            self._total -= 1
            return
        self._record(visit, visit.key(again), centred=sample.centred)

    def _record(self, visit: Visit, key: PoseKey, *, centred: bool) -> Sample | None:
        look = self._bench.look(self._options.dwell_s)
        if not usable(look):
            self._journal.event("skipped", {"placement": visit.placement, "why": "no light, or saturated, when read"})
            return None
        approach = self._navigator.approach.copy()
        sample = Sample(look, visit.placement, visit.target.first, approach, visit.repeat, centred)
        self._samples.append(sample)
        self._keys[key] = sample
        self._journal.sample(sample)
        self._journal.event("sample", key_detail(key, look))
        return sample

    def _learn(self) -> None:
        self._learner.learn([*self._earlier.values(), *self._samples])
        self._learned = len(self._samples)
        self._navigator.relearned()

    def _astray(self) -> None:
        self._lit = None

    def _say(self, phase: Phase, block: Block) -> None:
        done = self._before + len(self._samples)
        self._tell(Progress(phase, done, self._total, self._skipped, block.placement, block.first))


def usable(look: Look) -> bool:
    """Whether both faces have light, and none too much."""
    return all(face.lit and not face.saturated for face in (look.psd1, look.psd2))
