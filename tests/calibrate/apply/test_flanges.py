"""Flanges at values near known ones are those of the whole chain, effects included."""

from pathlib import Path

import numpy as np
import pytest

from acquisition.recording.rig import load_rig
from calibrate.apply.predicting import Flanges
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.effects.ports import Perturbation
from calibrate.model.parameters import start_values
from calibrate.model.with_effects.ported_chain import perturbed_frames

RIG = Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd.toml"
ROWS = 20


@pytest.fixture(scope="module")
def known():
    rng = np.random.default_rng(1)
    arm = arm_of(load_rig(RIG))
    n = arm.n_joints
    by = Perturbation(
        rng.normal(0.0, 1e-4, (ROWS, n)),
        rng.normal(0.0, 1e-4, (ROWS, n + 1, 6)),
        rng.normal(0.0, 1e-4, (ROWS, 6)),
        {},
        np.zeros((ROWS, n)),
    )
    return Flanges.of(arm, start_values(arm.parameters), rng.uniform(-2.0, 2.0, (ROWS, n)), by)


def test_one_value_at_a_time(known):
    for i in range(len(known.theta)):
        theta = known.theta.copy()
        theta[i] += 1e-3
        whole = perturbed_frames(known.arm, theta, known.q_rad, known.by)[:, -1]
        assert np.allclose(known.at(theta), whole, atol=1e-13)


def test_all_values_together(known):
    theta = known.theta + np.random.default_rng(2).normal(0.0, 1e-2, len(known.theta))
    whole = perturbed_frames(known.arm, theta, known.q_rad, known.by)[:, -1]
    assert np.allclose(known.at(theta), whole, atol=1e-12)
    assert not np.allclose(known.at(theta), known.at(known.theta), atol=1e-4)
