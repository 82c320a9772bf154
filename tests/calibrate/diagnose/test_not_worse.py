"""On rows that no fit has seen, geometry with the physics found is never worse than geometry alone."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording import read
from calibeam.results.diagnosis import diagnose_recording
from simulators.conceal.wanted import FAMILIES

from .concealed import recording_of

REAL = Path(__file__).parents[4] / "shared" / "data"
ROBOTS = ("ur5-tracker", "ur10-leica-a", "ur10-leica-b", "ur10-leica-d")
ROWS = 300  # of a real set, evenly over its time
DRAWN = (51, 52, 53)
DEFECTS = ("encoder-eccentricity", "worn-bearing")


def worse(file):
    """Splits in which all of the interval of what the physics removes is below nothing."""
    return [split for split in file.splits if split.removed_high is not None and split.removed_high < 0.0]


@pytest.mark.endure
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("name", ROBOTS)
def test_a_real_robot_is_not_predicted_worse(name):
    if not REAL.is_dir():
        pytest.skip("real data not found in ../shared/data beside the project")
    recording = read(REAL / name)
    rows = np.linspace(0, len(recording.samples) - 1, ROWS).astype(int)
    _, file = diagnose_recording(replace(recording, samples=recording.samples.take(rows)))
    assert file.splits
    assert worse(file) == []


@pytest.mark.endure
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", DRAWN)
def test_a_drawn_session_is_not_predicted_worse(family, seed, tmp_path):
    recording = recording_of(tmp_path, family=family, seed=seed, samples=160, places=4, defects=DEFECTS, enr=1.0)
    _, file = diagnose_recording(recording)
    assert file.splits
    assert worse(file) == []
