"""A designed plan on the emulated rig, in this process: its poses are taken, from their sides, repeats as repeats."""

from pathlib import Path

import numpy as np
from rich.console import Console

from acquisition.recording import RecordingWriter, Samples, read
from acquisition.recording.pose_plan import PosePlan, read_pose_plan, write_pose_plan
from acquisition.recording.rig import load_rig, plain_rig, rig_text
from acquisition.session.plan import PlanOptions
from calibeam.devices.recorder import record_session
from calibeam.motion.reachable_poses import candidates_of
from calibeam.printing.progress import progress_bar
from calibrate.design.candidates import blocks_of, plan_of, taken
from drivers.clock import SystemClock
from tests.support.direct_bench import direct_bench

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"


def test_a_repeated_pose_reaches_the_recording_as_one(tmp_path):
    """As `calibeam design` writes the plan and `calibeam session --plan` reads and takes it; without wires."""
    rig = load_rig(RIG)
    candidates = candidates_of(rig, 2, np.random.default_rng(1))
    first_place = np.flatnonzero(candidates.placement == 1)
    in_time = np.concatenate(blocks_of(candidates, first_place))
    plan = plan_of(rig.name, candidates, taken(candidates, in_time, 1, np.random.default_rng(2)), ())
    write_pose_plan(tmp_path / "plan.toml", plan)
    samples = _session(rig, read_pose_plan(tmp_path / "plan.toml", rig), tmp_path / "r.mcap")
    assert len(samples) == 5
    twice = np.flatnonzero(samples.integers("repeat", 0) == 1)
    assert len(twice) == 2
    approach = np.array([samples.column(f"approach{i}")[twice] for i in range(1, 7)])
    np.testing.assert_array_equal(approach[:, 0], -approach[:, 1])


def _session(rig, plan: PosePlan, path: Path) -> Samples:
    bench, clock = direct_bench(rig, plain_rig(rig_text(RIG), str(RIG)), seed=4), SystemClock()
    with RecordingWriter(path, rig_text=rig_text(RIG), software="test", clock=clock) as writer:
        summary = record_session(bench, rig, writer, PlanOptions(), clock, progress_bar(Console(quiet=True)), plan)
    assert summary.skipped == 0
    return read(path).samples
