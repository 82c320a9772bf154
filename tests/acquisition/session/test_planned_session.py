"""Explicit joint poses on the in-process bench: taken as asked, from the asked-for side; in the dark, found again."""

import dataclasses

import msgspec
import numpy as np
import pytest

from acquisition.errors import AcquisitionError
from acquisition.recording import RigFileError
from acquisition.recording.pose_plan import PlannedBlock, PlannedPose, PosePlan, read_pose_plan, write_pose_plan
from acquisition.session.plan import PlanOptions
from acquisition.session.session import Session, check_planned
from calibeam.learner import FittedLearner

from .test_session import Kept

OPTIONS = PlanOptions(centred=1, off_centre=2, repeats=0, roll_rad=(-1.0, 1.0))


@pytest.fixture(scope="module")
def plan(rig, plain_rig) -> PosePlan:
    """Every off-centre pose of a short session, from the other side."""
    from tests.support.direct_bench import direct_bench

    bench, kept = direct_bench(rig, plain_rig, seed=6), Kept()
    Session(bench, FittedLearner(rig), kept, OPTIONS, np.array(rig.motion.home_rad)).run((1,))
    blocks = tuple(
        PlannedBlock(
            pose=tuple(
                PlannedPose(
                    tuple(s.look.cmd_rad.tolist()), tuple((-s.approach).tolist()), tuple(s.look.spots_m().tolist())
                )
                for s in kept.samples
                if s.first == first and not s.centred
            ),
            placement=1,
            first_psd=first,
        )
        for first in (1, 2)
    )
    return PosePlan(schema=1, rig=rig.name, block=blocks, purpose=("tells one from another",))


def run(rig, bench, plan):
    kept = Kept()
    session = Session(bench, FittedLearner(rig), kept, OPTIONS, np.array(rig.motion.home_rad))
    return session.take_planned(plan), kept


def test_every_pose_is_taken_as_asked(rig, bench_of, plan):
    summary, _ = run(rig, bench_of(6), plan)
    asked = [(block.first_psd, pose) for block in plan.block for pose in block.pose]
    assert (len(summary.samples), summary.skipped) == (len(asked), 0)
    for sample, (first, pose) in zip(summary.samples, asked, strict=True):
        assert sample.first == first
        assert np.array_equal(sample.look.cmd_rad, pose.q_rad)
        assert np.array_equal(sample.approach[np.array(pose.approach) != 0], [w for w in pose.approach if w])
        assert np.max(np.abs(sample.look.spots_m() - pose.spots_m)) < 1e-4


def test_a_fixture_that_stands_at_another_place_is_found(rig, bench_of, plan):
    """Moved by more than a face: every pose is dark, and its spots are brought near where they were expected."""
    bench = bench_of(6)
    moved = tuple(
        dataclasses.replace(face, centre_m=(face.centre_m[0] + 0.025, *face.centre_m[1:]))
        for face in bench.world._faces_at[1]
    )
    bench.world._faces_at[1] = moved
    short = msgspec.structs.replace(plan, block=plan.block[:1])
    summary, kept = run(rig, bench, short)
    assert (len(summary.samples), summary.skipped) == (short.poses, 0)
    assert any(kind == "search" for kind, _ in kept.events)
    away = [s.look.spots_m() - p.spots_m for s, p in zip(summary.samples, short.block[0].pose, strict=True)]
    assert np.max(np.abs(away)) < 2.5e-3


def test_a_pose_into_the_table_is_skipped_and_said(rig, bench_of, plan):
    low = PlannedPose(tuple(np.array([0.0, 0.6, 0.0, 0.0, 0.0, 0.0])))
    block = msgspec.structs.replace(plan.block[0], pose=(low, plan.block[0].pose[0]))
    summary, kept = run(rig, bench_of(6), msgspec.structs.replace(plan, block=(block,)))
    assert (len(summary.samples), summary.skipped) == (1, 1)
    assert any(kind == "skipped" and "table" in detail["why"] for kind, detail in kept.events)


def test_a_file_reads_back_as_it_was_written(rig, plan, tmp_path):
    write_pose_plan(tmp_path / "next.toml", plan)
    assert read_pose_plan(tmp_path / "next.toml", rig) == plan


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("ur5e-dual-psd", "another", r"line 2: rig = 'another'"),
        ("placement = 1", "placement = 9", r"placement 9 is not in the rig"),
        ("q_rad = [", "q_rad = [0.0, ", r"q_rad has 7 angles, the arm 6 joints"),
        ("q_rad = [", "q_rad = [99.0, ", r"q_rad has 7"),
        ("first_psd = 1", "first_pds = 1", r"did you mean 'first_psd'"),
        ("schema = 1", "schema = ", r"not TOML"),
    ],
)
def test_a_wrong_file_is_one_sentence_with_its_line(rig, plan, tmp_path, old, new, says):
    path = tmp_path / "next.toml"
    write_pose_plan(path, plan)
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(RigFileError, match=says):
        read_pose_plan(path, rig)


def test_an_angle_beyond_its_joint_is_refused(rig, plan, tmp_path):
    first = plan.block[0]
    far = msgspec.structs.replace(first.pose[0], q_rad=(99.0, *first.pose[0].q_rad[1:]))
    block = msgspec.structs.replace(first, pose=(far,))
    write_pose_plan(tmp_path / "next.toml", msgspec.structs.replace(plan, block=(block,)))
    with pytest.raises(RigFileError, match="joint 1 at 99 rad is outside its range"):
        read_pose_plan(tmp_path / "next.toml", rig)


def test_what_a_session_cannot_do_is_refused_before_it_moves(plan):
    with pytest.raises(AcquisitionError, match="by hand"):
        check_planned(msgspec.structs.replace(plan, block=(PlannedBlock(pose=()),)))
    loaded = msgspec.structs.replace(plan.block[0], payload_kg=2.0)
    with pytest.raises(AcquisitionError, match="2 kg"):
        check_planned(msgspec.structs.replace(plan, block=(loaded,)))
