"""Laws that every arm model keeps: derivatives against differences, and the D-H arm against plain 4x4 products."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording.rig_schema import Arm, ArmModel, Joint, Pose, Rig, Tolerance
from calibrate.arms.catalogue import ARMS, arm_of
from calibrate.errors import DataError

STEP = 1e-6
UR5E = [(0.1625, 0, np.pi / 2), (0, -0.425, 0), (0, -0.3922, 0), (0.1333, 0, np.pi / 2), (0.0997, 0, -np.pi / 2)]
NAMES = ("a_m", "alpha_rad", "d_m", "theta_offset_rad")


def joint(d, a, alpha, offset=0.0):
    return Joint(lower_rad=-3.0, upper_rad=3.0, **dict(zip(NAMES, (a, alpha, d, offset), strict=True)))


def rig_of(model, flange=Pose()):  # noqa: B008 - frozen record
    joints = (*(joint(*row) for row in UR5E), joint(0.0996, 0, 0.2, 0.7))
    return Rig(1, "law", Arm(model, joints, flange=flange), tolerance=Tolerance(3e-4, 5e-4))


def twist_between(T_from, T_to):
    """[v; w] of the motion from one pose to the next, base frame, per unit."""
    move = T_to @ np.linalg.inv(T_from)
    w = Rotation.from_matrix(move[:, :3, :3]).as_rotvec()
    v = move[:, :3, 3] - np.cross(w, move[:, :3, 3]) / 2.0  # logarithm to second order in a tiny step
    return np.concatenate([v, w], axis=1)


@pytest.fixture(params=list(ARMS), ids=lambda m: m.value)
def arm(request):
    return arm_of(rig_of(request.param, Pose((0.01, -0.02, 0.03), (0.1, 0.2, -0.3))))


def test_parameter_twists_are_the_differences_of_the_flange(arm):
    rng = np.random.default_rng(1)
    theta, q = rng.normal(0, 0.05, len(arm.parameters)), rng.uniform(-3, 3, (7, arm.n_joints))
    analytic = arm.twists(theta, q)
    for k, step in enumerate(np.eye(len(theta)) * STEP):
        numeric = twist_between(arm.flange(theta - step, q), arm.flange(theta + step, q)) / (2 * STEP)
        np.testing.assert_allclose(analytic[:, :, k], numeric, atol=2e-9, err_msg=arm.parameters[k].name)


def test_joint_twists_are_the_differences_of_the_flange(arm):
    rng = np.random.default_rng(2)
    theta, q = rng.normal(0, 0.05, len(arm.parameters)), rng.uniform(-3, 3, (7, arm.n_joints))
    analytic = arm.joint_twists(theta, q)
    for k, step in enumerate(np.eye(arm.n_joints) * STEP):
        numeric = twist_between(arm.flange(theta, q - step), arm.flange(theta, q + step)) / (2 * STEP)
        np.testing.assert_allclose(analytic[:, :, k], numeric, atol=2e-9)


def test_dh_flange_is_the_product_of_its_links(ur5e_truth):
    truth = ur5e_truth(np.random.default_rng(3))
    joints = tuple(joint(d, a, alpha) for d, a, alpha, _ in truth.links)
    arm = arm_of(Rig(1, "ur5e", Arm(ArmModel.DH, joints), tolerance=Tolerance(3e-4, 5e-4)))
    theta = np.zeros(30)
    theta[4::5], theta[0::5] = truth.links[:, 3], truth.zeros
    q = np.random.default_rng(4).uniform(-3, 3, (5, 6))
    expected = np.array([truth.flange(row + truth.zeros) for row in q])
    np.testing.assert_allclose(arm.flange(theta, q), expected, atol=1e-13)


def test_on_a_right_angle_link_zero_and_tilt_only_add_up():
    arm = arm_of(rig_of(ArmModel.DH))
    names = [p.name for p in arm.parameters]
    twists = arm.twists(np.zeros(30), np.random.default_rng(5).uniform(-3, 3, (4, 6)))
    zero, tilt = twists[:, :, names.index("joint4.zero")], twists[:, :, names.index("link4.tilt")]
    np.testing.assert_allclose(zero, tilt, atol=1e-12)


def test_without_tolerance_the_links_are_held_and_zeros_stay_free():
    rig = rig_of(ArmModel.DH)
    arm = arm_of(Rig(1, "exact", rig.arm))
    assert {p.name for p in arm.parameters if p.free} == {f"joint{i}.zero" for i in range(1, 7)}


def test_an_arm_model_without_a_fit_is_refused_by_name():
    unknown = next(m for m in ArmModel if m not in ARMS)
    with pytest.raises(DataError, match=f"'{unknown.value}' cannot be identified; known: dh"):
        arm_of(rig_of(unknown))
