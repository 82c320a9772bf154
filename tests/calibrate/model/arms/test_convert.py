"""Conversions of arm models: the same flange through the models themselves, and how large the left error is."""

from pathlib import Path

import numpy as np
import pytest

from acquisition.recording.rig import Arm, ArmModel, Joint, Pose, Rig, load_rig
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.convert import convert
from calibrate.model.arms.table import NearParallel
from calibrate.model.parameters import values_by_name

RIGS = Path(__file__).parents[4] / "rigs"
UR5E = load_rig(RIGS / "ur5e-dual-psd.toml").arm
CMM = load_rig(RIGS / "arm-cmm-reference.toml").arm
MODELS = tuple(ArmModel)


def flange(arm, corrections, q):
    model = arm_of(Rig(1, "conversion", arm))
    return model.flange(values_by_name(model.parameters, corrections), q)


def errors_of(arm, size, seed=1):
    """Every parameter off; tilts only where they are something of their own."""
    rng = np.random.default_rng(seed)
    parameters = arm_of(Rig(1, "conversion", arm)).parameters
    return {p.name: float(v) for p, v in zip(parameters, rng.normal(0, size, len(parameters)), strict=True)}


def readings(arm, n=30):
    return np.random.default_rng(2).uniform(-3, 3, (n, len(arm.joints)))


def rows_of(arm):
    return np.array([[j.theta_offset_rad or 0.0, j.d_m, j.a_m, j.alpha_rad] for j in arm.joints])


@pytest.mark.parametrize("to", MODELS, ids=lambda m: m.value)
@pytest.mark.parametrize("arm", [UR5E, CMM], ids=["ur5e", "arm-cmm"])
@pytest.mark.parametrize("size", [0.0, 1e-3, 0.05], ids=["as drawn", "as made", "far off"])
def test_the_new_arm_has_the_flange_of_the_old_one(arm, to, size):
    errors = errors_of(arm, size)
    new = convert(arm, to, errors)
    q = readings(arm)
    np.testing.assert_allclose(new.T_base_new @ flange(new.arm, new.corrections, q), flange(arm, errors, q), atol=1e-12)
    assert new.error.position_max_m < 1e-12
    assert new.error.angle_max_rad < 1e-12


@pytest.mark.parametrize("by", [ArmModel.MDH, ArmModel.LOCAL_POE], ids=lambda m: m.value)
def test_a_table_comes_back_from_another_model_number_by_number(by):
    there = convert(UR5E, by)
    back = convert(there.arm, ArmModel.DH, there.corrections)
    np.testing.assert_allclose(rows_of(back.arm), rows_of(UR5E), atol=1e-12)
    np.testing.assert_allclose(back.T_base_new, np.eye(4), atol=1e-12)
    assert max(map(abs, back.corrections.values()), default=0.0) < 1e-12


def test_parallel_axes_that_are_off_get_a_tilt_and_keep_their_offset():
    errors = {"link2.twist": 3e-4, "link2.tilt": -2e-4}
    new = convert(convert(UR5E, ArmModel.LOCAL_POE, errors).arm, ArmModel.DH)
    assert new.corrections["link2.tilt"] == pytest.approx(-2e-4, abs=1e-12)
    assert rows_of(new.arm)[1] == pytest.approx([0.0, 0.0, -0.425, 3e-4], abs=1e-12)


def test_without_tilt_the_common_normal_runs_away_but_the_flange_stays():
    new = convert(UR5E, ArmModel.DH, {"link2.tilt": 2e-4}, NearParallel.COMMON_NORMAL)
    assert not new.corrections
    assert abs(new.arm.joints[2].d_m) > 100.0
    assert new.error.position_max_m < 1e-10


def test_taken_as_parallel_leaves_the_error_of_the_small_angle():
    """A tilt of 0.2 mrad on link 2 shifts the flange by its lever, at most the reach behind it."""
    new = convert(UR5E, ArmModel.DH, {"link2.tilt": 2e-4}, NearParallel.AS_PARALLEL)
    assert not new.corrections
    assert new.error.angle_max_rad == pytest.approx(2e-4, rel=1e-6)
    assert new.error.angle_rms_rad == pytest.approx(2e-4, rel=1e-6)
    reach = 0.3922 + 0.1333 + 0.0997 + 0.0996
    assert 0.0 < new.error.position_rms_m < new.error.position_max_m < 2e-4 * reach


def test_a_first_axis_off_the_base_moves_the_base_of_a_table():
    joints = (Joint(-3.0, 3.0, 0.1, 0.3, 0.2, 0.4), *(Joint(-3.0, 3.0, 0.3, 1.2, 0.1, 0.0),) * 3)
    arm = Arm(ArmModel.MDH, joints, flange=Pose((0.0, 0.0, 0.1)))
    new = convert(arm, ArmModel.DH)
    c, s = np.cos(0.3), np.sin(0.3)
    np.testing.assert_allclose(new.T_base_new[:3, 2], [0.0, -s, c], atol=1e-15)
    assert new.arm.gravity_m_s2 == pytest.approx(new.T_base_new[:3, :3].T @ [0.0, 0.0, -9.81])
    assert new.error.position_max_m < 1e-12


def test_limits_and_gears_are_those_of_the_old_joints():
    new = convert(UR5E, ArmModel.LOCAL_POE)
    for old, joint in zip(UR5E.joints, new.arm.joints, strict=True):
        kept = (joint.lower_rad, joint.upper_rad, joint.gear_ratio, joint.mass_kg)
        assert kept == (old.lower_rad, old.upper_rad, old.gear_ratio, old.mass_kg)
        assert joint.com_m is None


def test_a_correction_of_no_parameter_is_refused():
    with pytest.raises(KeyError, match=r"link9\.length"):
        convert(UR5E, ArmModel.MDH, {"link9.length": 1e-3})
