"""Candidates of the shipped rig, few enough for every day, and what they would tell."""

from pathlib import Path

import numpy as np
import pytest

from acquisition.recording.rig import load_rig
from calibeam.motion.reachable_poses import candidates_of
from calibrate.design.information import information_of

RIG = Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd.toml"


@pytest.fixture(scope="session")
def rig():
    return load_rig(RIG)


@pytest.fixture(scope="session")
def candidates(rig):
    return candidates_of(rig, 12, np.random.default_rng(1))


@pytest.fixture(scope="session")
def information(rig, candidates):
    return information_of(rig, candidates, np.random.default_rng(2))
