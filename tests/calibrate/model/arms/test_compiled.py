"""The compiled loops say what the numpy models say, for every kind of arm and every length of batch."""

import numpy as np
import pytest

from acquisition.recording.rig import Arm, ArmModel, Joint, Pose, Rig, Tolerance
from calibrate.model.arms import compiled
from calibrate.model.arms.catalogue import ARMS, arm_of
from calibrate.model.arms.serial import point_by_parameter

BATCHES = (1, 127, 128, 129, 300)


def rows_of(model, rng, n):
    """Joints of a random arm; the two ways to write a joint exclude each other."""
    if model is ArmModel.LOCAL_POE:
        return tuple(
            Joint(
                lower_rad=-3.0,
                upper_rad=3.0,
                origin_m=tuple(rng.normal(0, 0.3, 3)),
                rotation_rad=tuple(rng.normal(0, 1, 3)),
            )
            for _ in range(n)
        )
    return tuple(
        Joint(lower_rad=-3.0, upper_rad=3.0, d_m=d, a_m=a, alpha_rad=alpha, theta_offset_rad=offset)
        for d, a, alpha, offset in rng.normal(0, 0.5, (n, 4))
    )


@pytest.fixture(params=[(m, n) for m in ARMS for n in (1, 6, 7)], ids=lambda p: f"{p[0].value}-{p[1]}")
def arm(request):
    model, n = request.param
    rng = np.random.default_rng(n)
    flange = Pose((0.01, -0.02, 0.03), (0.1, 0.2, -0.3))
    return arm_of(Rig(1, "law", Arm(model, rows_of(model, rng, n), flange=flange), tolerance=Tolerance(3e-4, 5e-4)))


@pytest.fixture(autouse=True)
def numpy_models(monkeypatch):
    """The models under comparison never use the loops themselves."""
    monkeypatch.setattr(compiled, "worth", lambda poses: False)


def drawn(arm, poses, seed=0):
    rng = np.random.default_rng(seed)
    return rng.normal(0, 0.05, len(arm.parameters)), rng.uniform(-7, 7, (poses, arm.n_joints))


@pytest.mark.parametrize("poses", BATCHES)
def test_flange_poses_agree(arm, poses):
    theta, q = drawn(arm, poses)
    found = compiled.flange(compiled.ArmConstants.of(arm, theta), q)
    np.testing.assert_allclose(found, arm.flange(theta, q), atol=1e-12)


@pytest.mark.parametrize("poses", BATCHES)
def test_twists_agree(arm, poses):
    theta, q = drawn(arm, poses)
    np.testing.assert_allclose(
        compiled.twists(compiled.ArmConstants.of(arm, theta), q), arm.twists(theta, q), atol=1e-12
    )


@pytest.mark.parametrize("poses", BATCHES)
def test_a_tool_point_moves_as_the_twists_of_the_flange_say(arm, poses):
    theta, q = drawn(arm, poses)
    tool = np.array([0.02, -0.01, 0.08])
    point, jacobian = compiled.point_and_jacobian(compiled.ArmConstants.of(arm, theta), tool, q)
    T, twists = arm.flange(theta, q), arm.twists(theta, q)
    expected = T[:, :3, :3] @ tool + T[:, :3, 3]
    np.testing.assert_allclose(point, expected, atol=1e-12)
    velocity = twists[:, :3] + np.cross(twists[:, 3:], expected[:, :, None], axis=1)
    np.testing.assert_allclose(jacobian, velocity, atol=1e-12)


def test_a_point_and_its_derivatives_are_the_same_by_loops_and_by_numpy(arm, monkeypatch):
    theta, q = drawn(arm, 300)
    tool = np.array([0.02, -0.01, 0.08])
    by_numpy = point_by_parameter(arm, theta, tool, q)
    monkeypatch.setattr(compiled, "worth", lambda poses: True)
    for one, other in zip(by_numpy, point_by_parameter(arm, theta, tool, q), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)


def test_no_poses_give_empty_answers(arm):
    theta, q = drawn(arm, 0)
    constants = compiled.ArmConstants.of(arm, theta)
    assert compiled.flange(constants, q).shape == (0, 4, 4)
    assert compiled.twists(constants, q).shape == (0, 6, len(arm.parameters))


def test_readings_that_lie_across_memory_are_read_rightly(arm):
    theta, q = drawn(arm, 100)
    constants = compiled.ArmConstants.of(arm, theta)
    np.testing.assert_array_equal(compiled.flange(constants, np.asfortranarray(q)), compiled.flange(constants, q))


def test_a_reading_that_is_no_number_spoils_its_own_pose_only(arm):
    theta, q = drawn(arm, 100)
    constants = compiled.ArmConstants.of(arm, theta)
    clean = compiled.flange(constants, q)
    q[17, 0] = np.nan
    found = compiled.flange(constants, q)
    assert np.isnan(found[17, :3]).any()
    keep = np.arange(100) != 17
    np.testing.assert_array_equal(found[keep], clean[keep])


def test_a_large_batch_goes_through_the_loops_and_a_small_one_does_not(arm, monkeypatch):
    seen = []
    monkeypatch.setattr(compiled, "worth", lambda poses: seen.append(poses) or poses >= 100)
    theta, q = drawn(arm, 100)
    through_loops = arm.flange(theta, q)
    assert seen == [100]
    np.testing.assert_array_equal(through_loops, compiled.flange(compiled.ArmConstants.of(arm, theta), q))
    np.testing.assert_allclose(arm.flange(theta, q[:9]), through_loops[:9], atol=1e-12)
