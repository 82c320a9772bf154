"""A session on the in-process bench that is paused, broken off, ended, and gone on with: every pose once, none lost."""

import numpy as np
import pytest

from acquisition.errors import StoppedError
from acquisition.session.control import RunControl, RunState
from acquisition.session.plan import PlanOptions, PoseKey, blocks
from acquisition.session.session import Session
from calibeam.learner import FittedLearner
from drivers.errors import DeviceRefused
from tests.support.direct_bench import DirectBench

from .test_session import Kept

TINY = PlanOptions(centred=1, off_centre=2, repeats=1, roll_rad=(-0.8, 0.8))
PLAN = tuple(blocks((1,), 0.01, TINY))[:1]  # one order at one place
ALL = [key for block in PLAN for key in block.pose_keys()]


class Disturbed(DirectBench):
    """`trouble` is called before each motion with its number; what it raises ends the motion half way."""

    trouble = staticmethod(lambda move: None)

    def move(self, q_rad: np.ndarray) -> None:
        try:
            self.trouble(self.moves)
        except DeviceRefused:
            super().move(0.5 * (self.standing_rad + q_rad))
            raise
        super().move(q_rad)


@pytest.fixture
def bench(bench_of) -> Disturbed:
    plain = bench_of(6)
    return Disturbed(plain.world, plain.half_size_m)


def session_on(rig, bench, kept: Kept, control: RunControl, **more) -> Session:
    return Session(bench, FittedLearner(rig), kept, TINY, np.array(rig.motion.home_rad), control=control, **more)


def keys_of(kept: Kept) -> list[PoseKey]:
    return [PoseKey(**detail["pose"]) for kind, detail in kept.events if kind == "sample"]


@pytest.mark.parametrize("at", [1, pytest.param(4, marks=pytest.mark.endure)])
def test_a_motion_broken_off_is_made_again_and_no_pose_is_lost(rig, bench, at) -> None:
    """On the way to the first light, and between poses."""
    kept, states = Kept(), list[str]()

    def changed(state: RunState) -> None:
        states.append(state.name)
        if state is RunState.PAUSED:
            control.resume()

    control = RunControl(bench.stop, changed=changed)

    def trouble(move: int) -> None:
        if move == at and "PAUSED" not in states:
            control.pause()
            control.pause()
            control.resume()  # comes too early, and means nothing while the arm is being stopped
            raise DeviceRefused("robot: the motion was ended by stop()")

    bench.trouble = trouble
    summary = session_on(rig, bench, kept, control).take(PLAN)
    assert states[:4] == ["RUNNING", "PAUSING", "BREAKING", "PAUSED"]
    assert sorted(map(repr, keys_of(kept))) == sorted(map(repr, ALL))
    assert summary.skipped == 0


def test_after_a_pause_every_joint_still_comes_from_the_side_that_is_reported(rig, bench) -> None:
    control = RunControl(bench.stop, changed=lambda state: control.resume() if state is RunState.PAUSED else None)

    class Watched(Kept):
        def sample(self, sample) -> None:
            super().sample(sample)
            if len(self.samples) == 2:  # a person pushes the arm away while it is paused
                control.pause()
                bench.move(bench.standing_rad + 0.02)

    kept = Watched()
    session_on(rig, bench, kept, control).take(PLAN)
    plain, again, other = [sample for sample in kept.samples if sample.repeat is not None]
    moved = plain.approach != 0
    assert np.array_equal(again.approach[moved], plain.approach[moved])
    assert np.array_equal(other.approach[moved], -plain.approach[moved])


@pytest.mark.parametrize("taken", [2, 3])  # of three poses: then only the repeats of one are left
def test_what_was_taken_is_not_taken_again(rig, bench, taken) -> None:
    kept, control = Kept(), RunControl(bench.stop)

    class Enough(Kept):
        def sample(self, sample) -> None:
            super().sample(sample)
            if len(self.samples) == taken:
                control.stop()

    first = Enough()
    assert len(session_on(rig, bench, first, control).take(PLAN).samples) == taken
    earlier = dict(zip(keys_of(first), first.samples, strict=True))
    session_on(rig, bench, kept, RunControl(bench.stop), earlier=earlier).take(PLAN)
    assert sorted(map(repr, [*keys_of(first), *keys_of(kept)])) == sorted(map(repr, ALL))


def test_an_abort_stops_the_arm_and_keeps_what_was_taken(rig, bench) -> None:
    control = RunControl(bench.stop)

    class Given(Kept):
        def sample(self, sample) -> None:
            super().sample(sample)
            if len(self.samples) == 2:
                control.abort()
                moves.append(bench.moves)

    moves: list[int] = []
    session = session_on(rig, bench, Given(), control)
    with pytest.raises(StoppedError, match="aborted, the arm stands"):
        session.take(PLAN)
    assert session.taken == 2
    assert moves == [bench.moves]
