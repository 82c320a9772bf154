"""How the flange lies in a model's last frame: as far off as the other links, unless targets show it."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import Rig, parse_rig
from calibrate.apply.correct.mounting import mounting
from calibrate.model.arms.rig_arm import RigArm
from calibrate.model.predict import Predictor
from tests.calibrate.apply.correct.six_joints import RIG

ZERO_RAD = 4e-3
NAMES = [f"joint{j}.zero" for j in range(1, 6)]
LINKS = {"link1.length": 5e-4, "link2.length": -6e-4, "link3.length": 4e-4, "link3.twist": 1e-3, "link4.twist": -8e-4}
POINTS_M = np.array([[0.1, 0.0, 0.02], [-0.05, 0.09, 0.02], [-0.05, -0.09, 0.05], [0.0, 0.0, 0.15]])


def flange(targets_m=None, off=None, seed=1, more=""):
    """Of an arm whose zeros are off by `ZERO_RAD`; `targets_m` (target, 3) as stated, of a flange that is `off`."""
    rng = np.random.default_rng(seed)
    values = dict(zip(NAMES, ZERO_RAD * rng.choice([-1.0, 1.0], 5), strict=True)) | LINKS
    text = RIG
    if targets_m is not None:
        text += "".join(
            f"\n[[target]]\nid = {k}\npoint_m = {p.tolist()}\n{more}" for k, p in enumerate(targets_m, start=1)
        )
    rig: Rig = parse_rig(text, "rig.toml")
    drawn = RigArm.of_rig(rig)
    bare = mounting(Predictor(rig, values, {}, ("position",)), drawn, RigArm.of_rig(rig, values))
    if targets_m is None:
        return bare
    seen_m = targets_m @ (bare.T @ off)[:3, :3].T + (bare.T @ off)[:3, 3]
    for k, (seen, stated) in enumerate(zip(seen_m, targets_m, strict=True), start=1):
        values |= dict(zip((f"target{k}.x", f"target{k}.y", f"target{k}.z"), seen - stated, strict=True))
    found = mounting(Predictor(rig, values, {}, ("position",)), drawn, RigArm.of_rig(rig, values))
    return found, bare.T @ off


def turned(angle_rad, shift_m):
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = Rotation.from_rotvec(angle_rad).as_matrix(), shift_m
    return out


def test_about_the_last_axis_the_flange_is_as_far_off_as_the_zeros_of_the_other_joints():
    """The IRB 120's flange is drawn with its z along joint 6."""
    sigma_rad = np.sqrt(np.diag(flange().covariance)[3:])
    assert sigma_rad[2] == pytest.approx(ZERO_RAD, rel=0.4)
    assert np.all(sigma_rad[:2] < 0.5 * sigma_rad[2])


def test_a_tool_is_less_certain_the_farther_it_lies_from_the_flange():
    found = flange()
    near, far = found.sigma_m(np.array([0.02, 0.0, 0.0])), found.sigma_m(np.array([0.2, 0.0, 0.0]))
    assert far > 1.5 * near > 0.0
    assert np.isnan(found.lever_m(np.zeros(3)))  # nothing was measured


def test_targets_that_agree_with_each_other_show_the_flange():
    off = turned([1e-3, -2e-3, 5e-3], [4e-4, -3e-4, 2e-4])
    (found, true), bare = flange(POINTS_M, off), flange()
    assert np.linalg.norm((found.T - true)[:3, 3]) < 1e-4
    assert Rotation.from_matrix(found.T[:3, :3].T @ true[:3, :3]).magnitude() < 1e-3
    assert found.sigma_rad < 0.3 * bare.sigma_rad
    assert found.lever_m(POINTS_M[0] + [0.0, 0.0, 0.03]) == pytest.approx(0.03)


def test_three_targets_are_worth_what_is_stated_of_their_places():
    """Three points off by 0.1 mm or so agree by chance; stated to be measured, they show the flange better."""
    off, three = turned([1e-3, -2e-3, 5e-3], [4e-4, -3e-4, 2e-4]), POINTS_M[:3]
    (by_hand, _), (measured, true) = (flange(three, off, more=more) for more in ("", "point_sigma_m = 2e-5\n"))
    assert measured.sigma_rad < 0.3 * by_hand.sigma_rad
    assert 1e-4 < measured.sigma_rad < 1e-3  # 20 um over 0.1 m
    assert Rotation.from_matrix(measured.T[:3, :3].T @ true[:3, :3]).magnitude() < 3.0 * measured.sigma_rad
