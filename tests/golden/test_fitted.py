"""Every parameter of the arm, by each instrument and several together, by each arm model, and by a plan's every key."""

import pytest

from . import answers
from .agreement import parameter_differences

# Daily stand for them: "demo" for spots, "cones-oval-ring" for bars, "tracker-heated-link" for a tracker.
ENDURED = {"spots-and-bar-gear-ratio", "tracker-soft-joint"}


def marked(name):
    return pytest.param(name, marks=pytest.mark.endure if name in ENDURED else ())


@pytest.mark.parametrize("name", [marked(name) for name in answers.FITTED])
def test_the_parameters_are_as_frozen_and_the_same_are_not_determined(frozen, tmp_path, name):
    assert parameter_differences(answers.fitted(name, tmp_path), frozen("fitted")[name]) == []
