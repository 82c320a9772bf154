"""A designed plan on the emulated rig, in this process: its poses are taken, from their sides, repeats as repeats."""

from pathlib import Path

import numpy as np

from acquisition.plan import PlanOptions
from acquisition.planned_session import PlannedSession
from acquisition.recording.pose_plan import PosePlan
from acquisition.recording.rig import load_rig, plain_rig, rig_text
from calibeam.direct import direct_bench
from calibeam.learner import FittedLearner
from calibeam.pose_design.reachable import candidates_of
from calibrate.pose_design.plan_of import blocks_of, plan_of, taken

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"


class Silent:
    def event(self, name: str, data: object) -> None:
        pass

    def sample(self, sample: object) -> None:
        pass


def test_a_repeated_pose_reaches_the_samples_as_one():
    rig = load_rig(RIG)
    candidates = candidates_of(rig, 2, np.random.default_rng(1))
    first_place = np.flatnonzero(candidates.placement == 1)
    in_time = np.concatenate(blocks_of(candidates, first_place))
    plan = plan_of(rig.name, candidates, taken(candidates, in_time, 1, np.random.default_rng(2)), ())
    summary = _session(rig, plan)
    assert (len(summary.samples), summary.skipped) == (5, 0)
    twice = [sample for sample in summary.samples if sample.repeat == 1]
    assert len(twice) == 2
    assert np.all(twice[0].approach == -twice[1].approach)
    assert twice[0].row()["repeat"] == 1


def _session(rig, plan: PosePlan):
    bench = direct_bench(rig, plain_rig(rig_text(RIG), str(RIG)), seed=4)
    return PlannedSession(bench, FittedLearner(rig), Silent(), PlanOptions(), np.array(rig.motion.home_rad)).run(plan)
