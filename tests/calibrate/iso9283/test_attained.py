"""Recordings of a pose test: frames, poses with and without numbers, what a model predicts and corrects."""

import numpy as np
import pytest

from acquisition.recording import Samples, readings_sha256
from acquisition.recording.pose_plan import PlannedBlock, PlannedPose, PosePlan
from acquisition.recording.rig import parse_rig
from acquisition.recording.samples import measured_sha256
from calibrate.apply.correct.corrected import Options, Wanted, correct
from calibrate.errors import DataError
from calibrate.iso9283.attained import evaluate
from tests.calibrate.apply.correct.six_joints import inverse as inverse_kinematics
from tests.calibrate.iso9283.tracked_six_joints import (
    DEVICE,
    DRAWN,
    POINT_M,
    REAL,
    RIG_HERE,
    RIG_TEXT,
    cycles,
    known,
    planned_rad,
    seen,
)

Q = planned_rad()
POSE = cycles(6)
RNG_OFF_M = np.random.default_rng(4).normal(0.0, 2e-5, (len(POSE), 3))


def plan_of(q_rad):
    poses = tuple(PlannedPose(q_rad=tuple(q), repeat=k) for k, q in enumerate(q_rad.tolist(), start=1))
    return PosePlan(schema=1, rig=RIG_HERE.name, block=(PlannedBlock(pose=poses),))


def true_error_m(number):
    return float(np.linalg.norm(REAL.tip_m(Q[[number - 1]]) - DRAWN.tip_m(Q[[number - 1]])))


def test_accuracy_is_the_error_of_the_arm_where_the_device_is_known():
    found = evaluate(seen(Q[POSE - 1], POSE), RIG_HERE, frame="rig")
    for one in found.measured.poses:
        assert one.accuracy_m.value == pytest.approx(true_error_m(one.pose), abs=1e-9)
        assert one.repeatability_m.value == pytest.approx(0.0, abs=1e-9)
        assert one.accuracy_m.value > 5e-4  # the arm is really off


def test_the_model_predicts_the_accuracy_and_its_correction_leaves_only_scatter():
    found = evaluate(seen(Q[POSE - 1], POSE, RNG_OFF_M), RIG_HERE, known())
    assert found.frame == "model"
    for one, better in zip(found.measured.poses, found.corrected.poses, strict=True):
        assert found.predicted_m[one.pose][0] == pytest.approx(true_error_m(one.pose), abs=2e-8)
        assert abs(one.accuracy_m.value - true_error_m(one.pose)) < 5.0 * one.accuracy_m.sigma
        assert better.accuracy_m.value < 3e-5
        assert better.repeatability_m.value == pytest.approx(one.repeatability_m.value, rel=1e-6)


def test_a_model_corrects_no_test_that_it_was_fitted_to():
    samples = seen(Q[POSE - 1], POSE, RNG_OFF_M)
    older = {"readings_sha256": readings_sha256(samples)}  # as earlier versions wrote it: of joint angles alone
    hashes = {**older, "measured_sha256": measured_sha256(samples)}
    own = evaluate(samples, RIG_HERE, known(**hashes))
    assert own.corrected is None
    assert not own.predicted_m
    assert any(note.startswith("same data") for note in own.notes)
    assert own.measured == evaluate(samples, RIG_HERE, known()).measured
    anew = evaluate(seen(Q[POSE - 1], POSE, -RNG_OFF_M), RIG_HERE, known(**hashes))
    assert anew.corrected is not None
    assert not any(note.startswith("same") for note in anew.notes)
    unknown = evaluate(samples, RIG_HERE, known(**older))
    assert unknown.corrected is not None
    assert any(note.startswith("same joint angles") for note in unknown.notes)


def test_a_fitted_frame_absorbs_where_the_device_stands_and_no_distance():
    moved = ((2.0, 0.3, 0.1), (0.0, 0.4, -1.0))
    here = evaluate(seen(Q[POSE - 1], POSE, RNG_OFF_M), RIG_HERE, known(), frame="fit")
    there = evaluate(seen(Q[POSE - 1], POSE, RNG_OFF_M, moved), RIG_HERE, known(), frame="fit")
    # The scatter was added in the base, so both devices see the same test.
    for one, other in zip(here.measured.poses, there.measured.poses, strict=True):
        assert one.accuracy_m.value == pytest.approx(other.accuracy_m.value, abs=1e-9)
        assert one.accuracy_m.value < true_error_m(one.pose)
    assert all(one.accuracy_m.value < 3e-5 for one in there.corrected.poses)
    exact = evaluate(seen(Q[POSE - 1], POSE, RNG_OFF_M), RIG_HERE, frame="rig").measured.distance
    assert there.measured.distance.accuracy_m.value == pytest.approx(exact.accuracy_m.value, abs=1e-9)


def test_a_device_that_was_moved_since_the_session_of_the_model_is_named():
    moved = (tuple(np.add(DEVICE[0], 0.01)), DEVICE[1])
    notes = evaluate(seen(Q[POSE - 1], POSE, device=moved), RIG_HERE, known()).notes
    assert any("have been moved" in note for note in notes)
    assert not any("have been moved" in n for n in evaluate(seen(Q[POSE - 1], POSE), RIG_HERE, known()).notes)


def test_corrected_commands_are_judged_by_the_poses_of_the_plan():
    wanted = DRAWN.frames(Q)[:, -1].copy()
    wanted[:, :3, 3] = DRAWN.tip_m(Q)
    goal = Wanted(wanted, np.full(Q.shape, np.nan), Q, {})
    sent = correct(known(), goal, inverse_kinematics(), Options()).q_rad
    with_plan = evaluate(seen(sent[POSE - 1], POSE), RIG_HERE, plan=plan_of(Q), frame="rig").measured
    without = evaluate(seen(sent[POSE - 1], POSE), RIG_HERE, frame="rig").measured
    for better, as_sent in zip(with_plan.poses, without.poses, strict=True):
        assert better.accuracy_m.value < 1e-8
        assert as_sent.accuracy_m.value == pytest.approx(true_error_m(as_sent.pose), rel=0.05)  # of the commands


def test_poses_without_numbers_are_found_by_their_joints():
    numbered = evaluate(seen(Q[POSE - 1], POSE, RNG_OFF_M), RIG_HERE, frame="rig").measured
    found = evaluate(seen(Q[POSE - 1], None, RNG_OFF_M), RIG_HERE, frame="rig").measured
    assert [one.cycles for one in found.poses] == [one.cycles for one in numbered.poses]
    accuracy = {round(one.accuracy_m.value, 12) for one in found.poses}
    assert accuracy == {round(one.accuracy_m.value, 12) for one in numbered.poses}
    by_plan = evaluate(seen(Q[POSE - 1], None, RNG_OFF_M), RIG_HERE, plan=plan_of(Q), frame="rig").measured
    assert by_plan == numbered


def test_readings_are_taken_where_no_command_is_recorded_and_this_is_named():
    samples = seen(Q[POSE - 1], POSE)
    columns = {name: values for name, values in samples.columns.items() if not name.startswith("cmd")}
    scatter = np.random.default_rng(5).normal(0.0, 1e-5, (len(POSE), 6))
    columns |= {f"q{j + 1}_rad": columns[f"q{j + 1}_rad"] + scatter[:, j] for j in range(6)}
    found = evaluate(Samples(columns, 6), RIG_HERE, frame="rig")
    assert any("cmd1_rad" in note for note in found.notes)
    assert found.measured.poses[0].accuracy_m.value == pytest.approx(true_error_m(1), abs=5e-5)


def test_orientation_errors_are_those_of_the_arm_less_their_mean():
    found = evaluate(seen(Q[POSE - 1], POSE, turned=True), RIG_HERE, known())
    angles = np.array([[a.value for a in one.turn_rad] for one in found.measured.poses])
    assert np.abs(angles).max() > 2e-4
    assert np.abs(angles.mean(axis=0)).max() < 1e-3
    corrected = np.array([[a.value for a in one.turn_rad] for one in found.corrected.poses])
    assert np.abs(corrected).max() < 1e-9


def test_recorded_approaches_make_the_variation():
    side = np.repeat([-1.0, 1.0], 15)
    samples = seen(Q[np.zeros(30, dtype=int)], np.ones(30), np.where(side[:, None] > 0, [4e-5, 0.0, 0.0], 0.0))
    columns = {**samples.columns, **{f"approach{j + 1}": side for j in range(6)}}
    one = evaluate(Samples(columns, 6), RIG_HERE, frame="rig").measured.poses[0]
    assert one.variation_m.value == pytest.approx(4e-5, abs=1e-9)
    assert one.cycles == 15


def test_without_a_tool_point_the_target_is_the_models():
    no_point = parse_rig(RIG_TEXT.replace(f"point_m = {list(POINT_M)}\n", ""), "rig.toml")
    samples = seen(Q[POSE - 1], POSE)
    with pytest.raises(DataError, match="point_m"):
        evaluate(samples, no_point)
    found = evaluate(samples, no_point, known())
    assert any("is that of the model" in note for note in found.notes)
    for one in found.measured.poses:  # but for how the flanges of both arms lie on each other
        assert one.accuracy_m.value == pytest.approx(true_error_m(one.pose), abs=5e-4)
        assert found.predicted_m[one.pose][0] == pytest.approx(one.accuracy_m.value, abs=1e-8)


def test_what_is_missing_is_named():
    samples = seen(Q[POSE - 1], POSE)
    blind = Samples({n: v for n, v in samples.columns.items() if n not in ("x_m", "y_m", "z_m")}, 6)
    for given, options, says in (
        (blind, {}, "x_m"),
        (samples, {"frame": "model"}, "--model"),
        (seen(Q[np.zeros(10, dtype=int)], np.ones(10)), {"frame": "fit"}, "on a line"),
        (seen(Q[POSE - 1], POSE + 7), {"plan": plan_of(Q)}, "number 8"),
    ):
        with pytest.raises(DataError, match=says):
            evaluate(given, RIG_HERE, **options)
