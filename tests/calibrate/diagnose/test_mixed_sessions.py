"""Concealed effects in sessions of several instruments and of a 6-D target: named where they are, and not where not."""

import pytest

from calibeam.results.diagnosis import diagnose_recording
from tests.calibrate.diagnose.mixed_sessions import full_pose, spots_and_bar, tracker_and_cones, truth_of

CASES = [
    pytest.param(full_pose, 3, "encoder-eccentricity", marks=pytest.mark.endure),
    pytest.param(full_pose, 9, "worn-bearing", marks=pytest.mark.endure),  # daily: tests/golden
    (tracker_and_cones, 6, "soft-joint"),
    pytest.param(spots_and_bar, 4, "encoder-eccentricity", marks=pytest.mark.endure),  # daily: tracker and cones
]


@pytest.mark.parametrize(("made", "seed", "defect"), CASES)
def test_the_effect_is_named_in_its_place(made, seed, defect, tmp_path):
    recording, case = made(tmp_path, seed=seed, defects=(defect,), enr=1.0, samples=220)
    ((physics, port),) = truth_of(case)
    _, file = diagnose_recording(recording)
    assert file.verdict == "mismatch"
    assert [(one.physics, one.where) for one in file.findings] == [(physics, port)]
    assert file.free_space is not None
    assert file.free_space.rms_after_m < file.free_space.rms_before_m
    for split in file.splits:
        if split.split == "random":
            assert split.rms_after_m < 1.05 * split.rms_before_m, split.instrument


@pytest.mark.parametrize("made", [pytest.param(full_pose, marks=pytest.mark.endure), tracker_and_cones])
def test_a_session_of_several_instruments_without_an_effect_is_consistent(made, tmp_path):
    recording, _ = made(tmp_path, seed=5 if made is tracker_and_cones else 6, samples=220)
    _, file = diagnose_recording(recording)
    assert (file.verdict, file.findings) == ("consistent", ())
