"""Joint zeros by spots alone: of the demo recording, and of 20 concealed truths."""

import pytest

from . import answers
from .agreement import VALUE_SIGMAS, parameter_differences

UNSEEN = {"joint1.zero", "joint6.zero"}  # each only together with a place or with the laser's mount
DAILY = ("00", "03")  # more drawn truths: tests/calibrate/fit/identify/test_joint_zeros.py


def marked(name):
    return pytest.param(name, marks=() if name in DAILY else pytest.mark.endure)


def test_the_zeros_of_the_demo_recording_are_as_frozen(frozen, tmp_path):
    found = answers.zeros("demo", tmp_path)
    assert {zero for zero, of in found.items() if of is None} == UNSEEN
    assert parameter_differences(found, frozen("zeros")["demo"]) == []


@pytest.mark.parametrize("name", [marked(name) for name in answers.TRUTHS])
def test_the_zeros_of_a_concealed_truth_are_as_frozen_and_as_far_off(frozen, tmp_path, name):
    expected, found = frozen("zeros")[name], answers.zeros(name, tmp_path)
    assert {zero for zero, of in found.items() if of is None} == UNSEEN
    assert parameter_differences(found, expected) == []
    off = answers.sigmas_off(found, name)
    assert {z: s for z, s in off.items() if not abs(s - expected[z]["sigmas_off"]) <= VALUE_SIGMAS} == {}
    assert max(map(abs, off.values())) < 3.0
