"""Laws that every arm model keeps: derivatives against differences, and the D-H arm against plain 4x4 products."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import Arm, ArmModel, Joint, Pose, Rig, Tolerance
from calibrate.model.arms.catalogue import ARMS, arm_of
from calibrate.model.arms.link_tolerance import FREE, HELD_NOMINAL, LinkTolerance

STEP = 1e-6
UR5E = [(0.1625, 0, np.pi / 2), (0, -0.425, 0), (0, -0.3922, 0), (0.1333, 0, np.pi / 2), (0.0997, 0, -np.pi / 2)]
NAMES = ("a_m", "alpha_rad", "d_m", "theta_offset_rad")


def joint(d, a, alpha, offset=0.0):
    return Joint(lower_rad=-3.0, upper_rad=3.0, **dict(zip(NAMES, (a, alpha, d, offset), strict=True)))


def rig_of(model, flange=Pose()):  # noqa: B008 - frozen record
    rows = [(*row, 0.0) for row in UR5E] + [(0.0996, 0, 0.2, 0.7)]
    if model is ArmModel.MDH:  # twist and length stand one row later
        before = [(0.0, 0.0), *((a, alpha) for _, a, alpha, _ in rows)]
        rows = [(d, *link, offset) for (d, _, _, offset), link in zip(rows, before, strict=False)]
    joints = poe_joints(rows) if model is ArmModel.LOCAL_POE else tuple(joint(*row) for row in rows)
    return Rig(1, "law", Arm(model, joints, flange=flange), tolerance=Tolerance(3e-4, 5e-4))


def poe_joints(rows):
    """Fixed parts with nothing on an axis: shifts and turns by the rows' numbers, in all three directions."""
    return tuple(
        Joint(-3.0, 3.0, origin_m=(a, 0.1 * i, d), rotation_rad=(alpha, offset, -0.3))
        for i, (d, a, alpha, offset) in enumerate(rows)
    )


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


def test_no_pose_gives_empty_answers(arm):
    theta, q = np.zeros(len(arm.parameters)), np.empty((0, arm.n_joints))
    assert arm.flange(theta, q).shape == (0, 4, 4)
    assert arm.twists(theta, q).shape == (0, 6, len(arm.parameters))
    assert arm.joint_twists(theta, q).shape == (0, 6, arm.n_joints)


def test_joint_twists_are_the_differences_of_the_flange(arm):
    rng = np.random.default_rng(2)
    theta, q = rng.normal(0, 0.05, len(arm.parameters)), rng.uniform(-3, 3, (7, arm.n_joints))
    analytic = arm.joint_twists(theta, q)
    for k, step in enumerate(np.eye(arm.n_joints) * STEP):
        numeric = twist_between(arm.flange(theta, q - step), arm.flange(theta, q + step)) / (2 * STEP)
        np.testing.assert_allclose(analytic[:, :, k], numeric, atol=2e-9)


def test_an_answer_is_of_the_state_that_is_asked_whatever_was_asked_before(arm):
    theta, q = np.zeros(len(arm.parameters)), np.random.default_rng(3).uniform(-1.0, 1.0, (5, arm.n_joints))
    other, moved = theta + 1e-3, q + 0.1
    coupling = np.eye(arm.n_joints) + np.eye(arm.n_joints, k=-1)
    asked = [
        (arm, theta, q),
        (arm, theta, q),
        (arm, other, q),
        (arm, other, moved),
        (arm.coupled(coupling), other, moved),
    ]
    answers = [one.flange(at, readings) for one, at, readings in asked]
    assert np.array_equal(answers[0], answers[1])
    assert all(not np.allclose(before, after) for before, after in pairwise(answers[1:]))
    answers[0][:] = 0.0  # whoever is given an answer may write into it
    assert np.array_equal(arm.flange(theta, q), answers[1])


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


@pytest.mark.parametrize("model", list(ARMS))
def test_a_free_prior_frees_the_links_without_opinion_and_held_frees_the_zeros_only(model):
    free, held = arm_of(rig_of(model), FREE), arm_of(rig_of(model), HELD_NOMINAL)
    assert {p.name for p in held.parameters if p.free} == {f"joint{i}.zero" for i in range(1, 7)}
    assert all(p.prior == np.inf for p in free.parameters)
    assert sum(p.free for p in free.parameters) > 25


@pytest.mark.parametrize("model", list(ARMS))
def test_what_is_held_in_a_free_arm_is_another_name_of_a_zero(model):
    arm = arm_of(rig_of(model), FREE)
    q = np.random.default_rng(5).uniform(-3, 3, (9, 6))
    twists = arm.twists(np.zeros(len(arm.parameters)), q).reshape(54, -1)
    free = [k for k, p in enumerate(arm.parameters) if p.free]
    assert len(free) < len(arm.parameters)
    assert np.linalg.matrix_rank(twists[:, free]) == np.linalg.matrix_rank(twists)


def test_local_poe_sees_four_numbers_an_axis_and_six_of_the_flange():
    """Schroeer's count for turning joints and a measured pose: 4 R + 6."""
    arm = arm_of(rig_of(ArmModel.LOCAL_POE), FREE)
    q = np.random.default_rng(5).uniform(-3, 3, (9, 6))
    assert len(arm.parameters) == 6 * 7 + 6
    assert np.linalg.matrix_rank(arm.twists(np.zeros(48), q).reshape(54, -1)) == 30


@pytest.mark.parametrize("model", list(ARMS))
def test_a_drawing_tolerance_is_the_prior_of_lengths_and_angles_but_not_of_zeros(model):
    arm = arm_of(rig_of(model), LinkTolerance(1e-4, 2e-4))
    by_unit = {"m": 1e-4, "rad": 2e-4}
    for p in arm.parameters:
        if p.free:
            assert p.prior == (np.inf if p.name.endswith("zero") else by_unit[p.unit]), p.name


def test_a_negative_tolerance_is_refused():
    with pytest.raises(ValueError, match="a sigma is not negative"):
        LinkTolerance(-1e-4, 1e-4)
