"""Torques of a rigid arm against MuJoCo's inverse dynamics, which share nothing with them but the laws of motion."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import load_rig
from benchmarks.drawn_motion import in_mujoco
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.inverse_dynamics import NUMBERS, torque_columns
from calibrate.model.parameters import start_values

RIGS = Path(__file__).parents[4] / "rigs"
GRAVITY = np.array([0.6, -0.3, -9.7])


def drawn_links(n, rng):
    """(link, 10) of bodies that exist: mass, centre, and a tensor about the frame's origin by Steiner."""
    out = np.zeros((n, len(NUMBERS)))
    for link in range(n):
        mass, centre = rng.uniform(0.5, 8.0), rng.normal(0.0, 0.1, 3)
        turn = Rotation.random(random_state=rng.integers(1000)).as_matrix()
        spread = np.diag(rng.uniform(0.01, 0.2, 3))
        own = turn @ (np.trace(spread) * np.eye(3) - spread) @ turn.T
        tensor = own + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        entries = tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        out[link] = [mass, *(mass * centre), *entries]
    return out


@pytest.mark.parametrize("rig", ["ur5e-dual-psd.toml", "irb120-modbus.toml"])
def test_torques_are_those_of_mujoco(rig):
    rng = np.random.default_rng(3)
    arm = arm_of(load_rig(RIGS / rig))
    n, theta = arm.n_joints, start_values(arm.parameters)
    links = drawn_links(n, rng)
    model = in_mujoco(arm.frames(theta, np.zeros((1, n)))[0], links, GRAVITY)
    data = mujoco.MjData(model)
    q, qd, qdd = rng.uniform(-2.0, 2.0, (3, 20, n))
    columns = torque_columns(arm.frames(theta, q), qd, qdd, GRAVITY)
    torque_nm = np.einsum("rjlp,lp->rj", columns, links)
    for row in range(len(q)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[row], qd[row], qdd[row]
        mujoco.mj_inverse(model, data)
        np.testing.assert_allclose(torque_nm[row], data.qfrc_inverse, atol=1e-9 * np.abs(torque_nm).max())
