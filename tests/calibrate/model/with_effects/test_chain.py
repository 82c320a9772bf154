"""The derivative of the flange by the arm's values is that of the whole chain, effects included."""

from pathlib import Path

import numpy as np
import pytest

from acquisition.recording.rig import load_rig
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.effects.ports import Perturbation
from calibrate.model.parameters import start_values
from calibrate.model.with_effects.chain import twists_by_arm
from calibrate.model.with_effects.ported_chain import offsets, perturbed_frames

RIG = Path(__file__).parents[4] / "rigs" / "ur5e-dual-psd.toml"
ROWS = 20
STEP = 1e-5


@pytest.mark.parametrize("size", [0.0, 1e-2], ids=["no effect", "effects at every port"])
def test_every_value_moves_the_flange_as_its_derivative_states(size):
    rng = np.random.default_rng(1)
    arm = arm_of(load_rig(RIG))
    n = arm.n_joints
    by = Perturbation(
        rng.normal(0.0, size, (ROWS, n)),
        rng.normal(0.0, size, (ROWS, n + 1, 6)),
        rng.normal(0.0, size, (ROWS, 6)),
        {},
        np.zeros((ROWS, n)),
    )
    q_rad, theta = rng.uniform(-2.0, 2.0, (ROWS, n)), start_values(arm.parameters)
    frames = perturbed_frames(arm, theta, q_rad, by)
    twists = twists_by_arm(arm, theta, q_rad, by, frames)
    for step, twist in zip(STEP * np.eye(len(theta)), np.moveaxis(twists, 2, 0), strict=True):
        moved = perturbed_frames(arm, theta + step, q_rad, by)[:, -1]
        assert np.allclose(offsets(STEP * twist) @ frames[:, -1], moved, atol=20.0 * STEP**2)
        assert not np.allclose(frames[:, -1], moved, atol=20.0 * STEP**2)
