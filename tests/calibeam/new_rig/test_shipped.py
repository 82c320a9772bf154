"""Every shipped rig is read, says its source, and reaches what its source says.

Positions at zero (mm), in the controller's world, are sums of the drawn lengths: of FANUC, Motoman and Stäubli it is at
the height of axis 2, as the fixed joint base_link-base of their sources has it; reach (m) is that of the wrist centre,
as the model's name or the maker's page has it: KUKA R900 and R820, ABB 0.58 and 1.45. UR10e: manual, "Maximum
Payload", workspace of 1300 mm.
"""

import numpy as np
import pytest

from acquisition.recording.rig import load_rig
from calibeam.commands.rig import shipped_rigs, shipped_text
from calibrate.errors import DataError
from calibrate.model.arms.rig_arm import RigArm

AT_ZERO_MM = {
    "abb-irb120": (302 + 72, 0, 290 + 270 + 70),
    "abb-irb1600-6-1.2": (150 + 600 + 65, 0, 486.5 + 475),
    "abb-irb1600-8-1.45": (150 + 600 + 65, 0, 486.5 + 700),
    "fanuc-lrmate-200id": (50 + 335 + 80, 0, 330 + 35),
    "franka-fr3": (88, 0, 333 + 316 + 384 - 107),
    "franka-panda": (88, 0, 333 + 316 + 384 - 107),
    "kuka-iiwa14-r820": (0, 0, 360 + 420 + 400 + 152),
    "kuka-kr6-r900": (25 + 455 + 420 + 80, 0, 400 + 35),
    "motoman-gp8": (40 + 340 + 80, 0, 345 + 40),
    "staubli-tx2-60": (0, 20, 290 + 310 + 70),
    "ur10e": (-612.7 - 571.55, -174.15 - 116.55, 180.7 - 119.85),
    "ur16e": (-478.4 - 360, -174.15 - 116.55, 180.7 - 119.85),
    "ur20": (-862 - 728.7, -201 - 154.3, 236.3 - 159.3),
    "ur30": (-637 - 503.7, -201 - 154.3, 236.3 - 159.3),
    "ur3e": (-243.55 - 213.2, -131.05 - 92.1, 151.85 - 85.35),
    "ur5e": (-425 - 392.2, -133.3 - 99.6, 162.5 - 99.7),
}
WRIST_REACH_M = {"abb-irb120": 0.58, "abb-irb1600-8-1.45": 1.45, "kuka-iiwa14-r820": 0.82, "kuka-kr6-r900": 0.9}


@pytest.mark.parametrize("name", list(shipped_rigs()))
def test_a_shipped_rig_stands_at_zero_where_its_lengths_say(name):
    rig = load_rig(shipped_rigs()[name])
    at_zero_m = RigArm.of_rig(rig).flange(np.zeros(rig.n_joints))[:3, 3]
    np.testing.assert_allclose(1e3 * at_zero_m, AT_ZERO_MM[name], atol=1e-3)
    assert rig.name == name
    assert rig.arm.make
    assert "github.com" in shipped_text(name).splitlines()[1]
    assert all(j.upper_rad - j.lower_rad < 4 * np.pi + 1.5 for j in rig.arm.joints)


@pytest.mark.parametrize("name", list(WRIST_REACH_M))
def test_a_wrist_reaches_as_far_as_its_model_is_named_for(name):
    arm = RigArm.of_rig(load_rig(shipped_rigs()[name]))
    q_rad = np.random.default_rng(1).uniform(arm.lower_rad, arm.upper_rad, (20_000, arm.n_joints))
    reach_m = np.linalg.norm(arm.frames(q_rad)[:, -3, :2, 3], axis=1).max()
    assert reach_m == pytest.approx(WRIST_REACH_M[name], abs=2e-3)


def test_a_ur10e_works_to_1300_mm_between_wrist_and_flange():
    arm = RigArm.of_rig(load_rig(shipped_rigs()["ur10e"]))
    q_rad = np.random.default_rng(1).uniform(arm.lower_rad, arm.upper_rad, (20_000, 6))
    out_m = np.linalg.norm(arm.frames(q_rad)[:, :, :2, 3], axis=2).max(axis=0)
    assert out_m[-3] < 1.3 < out_m[-1]


def test_senses_and_couplings_are_declared_as_the_makes_have_them():
    def signs(name):
        return [i for i, joint in enumerate(load_rig(shipped_rigs()[name]).arm.joints, start=1) if joint.sign < 0]

    assert signs("kuka-kr6-r900") == [1, 4, 6]
    assert signs("abb-irb120") == signs("ur5e") == signs("staubli-tx2-60") == []
    follows = load_rig(shipped_rigs()["fanuc-lrmate-200id"]).arm.joints[2].follows
    assert (follows.joint, follows.by) == (2, 1.0)


def test_j2_of_a_fanuc_leaves_its_forearm_level():
    """As linkage_transform of fanuc_driver has it: the angle from the upper arm is J3 + J2."""
    arm = RigArm.of_rig(load_rig(shipped_rigs()["fanuc-lrmate-200id"]))
    forward = arm.flange(np.array([0.0, 0.4, 0.0, 0.0, 0.0, 0.0]))
    level = arm.flange(np.zeros(6))
    np.testing.assert_allclose(forward[:3, :3], level[:3, :3], atol=1e-12)
    np.testing.assert_allclose(
        forward[:3, 3] - level[:3, 3], [0.33 * np.sin(0.4), 0.0, 0.33 * (np.cos(0.4) - 1.0)], atol=1e-12
    )


def test_a_kuka_turns_by_a1_against_the_hand_that_closes_about_z():
    arm = RigArm.of_rig(load_rig(shipped_rigs()["kuka-kr6-r900"]))
    assert arm.flange(np.array([0.5, 0, 0, 0, 0, 0]))[1, 3] < 0.0
    assert arm.flange(np.array([0, -0.5, 0, 0, 0, 0]))[2, 3] > 0.435  # A2 less: up


def test_an_unknown_name_gets_the_nearest():
    with pytest.raises(DataError, match="ur5e"):
        shipped_text("ur5")
