"""What poses would tell, against differences and against a fit."""

from itertools import pairwise

import numpy as np
import pytest

from calibrate.design.information import ALONG_M, POSES, target_of
from calibrate.fit.identify.session import instruments_for_fit
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.assumed_rig import assumed_arm

LENGTH = ("link2.length", "link3.twist", "joint4.zero", "laser.tilt_u", "laser.shift_v")


def test_the_beam_moves_with_each_unknown_as_differences_say(rig, candidates):
    """Rigid motions are taken out of both; what is left across the beam must agree."""
    found = instruments_for_fit(rig, candidates.samples())
    parameters = found.weighting.parameters
    names = [p.name for p in parameters]
    target = target_of(rig, arm_of(rig), parameters, found.start, np.random.default_rng(3))
    joints = rig.arm.joints
    limits = [j.lower_rad for j in joints], [j.upper_rad for j in joints]
    q = np.random.default_rng(3).uniform(*limits, (POSES, len(joints)))

    def beams(values):
        arm = assumed_arm(rig, values)
        each = [arm.beam(one) for one in q]
        return np.array([o for o, _ in each]), np.array([d for _, d in each])

    (o, d), step = beams({}), 1e-6
    across = np.eye(3) - d[:, :, None] * d[:, None, :]
    points = np.concatenate([o + s * d for s in ALONG_M])
    project = np.tile(across, (2, 1, 1))
    turned = np.cross(np.eye(3)[None], points[:, None, :]).swapaxes(1, 2)
    rigid = (project @ np.concatenate([np.tile(np.eye(3), (len(points), 1, 1)), turned], axis=2)).reshape(-1, 6)
    for name in LENGTH:
        (o2, d2) = beams({name: step})
        moved = np.concatenate([(o2 - o) + s * (d2 - d) for s in ALONG_M]) / step
        seen = (project @ moved[:, :, None]).ravel()
        seen -= rigid @ np.linalg.lstsq(rigid, seen, rcond=None)[0]
        np.testing.assert_allclose(
            target.by[:, names.index(name)] * np.sqrt(len(points)), seen, atol=2e-5 * np.abs(seen).max() + 1e-9
        )


def test_nothing_that_the_beam_feels_is_hidden_from_all_poses(information):
    assert information.hidden.shape[1] > 0  # frames of base and fixture
    assert information.hidden_m < 1e-10


def test_more_poses_never_promise_less(information):
    errors = [information.free_space_m(information.of(np.arange(n))) for n in (10, 20, 40, 72)]
    assert all(a > b for a, b in pairwise(errors))


def test_the_promise_is_the_covariance_of_the_fit(information):
    A = information.of(np.arange(72))
    J = information.by_target - (information.by_target @ information.hidden) @ information.hidden.T
    assert information.free_space_m(A) == pytest.approx(np.sqrt(np.sum((J @ np.linalg.inv(A)) * J)))
