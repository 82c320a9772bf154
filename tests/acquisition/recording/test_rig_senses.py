"""Signs and couplings of joints: what the file says, what the reader makes of it, and what it refuses."""

import numpy as np
import pytest

from acquisition.recording import RigFileError
from acquisition.recording.rig import Pose, parse_rig

HEAD = 'schema = 1\nname = "two"\n[arm]\nmodel = "{}"\n{}'
DH = "[[arm.joint]]\na_m = 0.1\nalpha_rad = 0.3\nd_m = 0.2\ntheta_offset_rad = 0.4\nlower_rad = -1\nupper_rad = 2\n"
POE = "[[arm.joint]]\norigin_m = [0, 0, 0.2]\nrotation_rad = [0, 0, 0]\nlower_rad = -1\nupper_rad = 2\n"


def read(model, *joints, arm=""):
    return parse_rig(HEAD.format(model, arm) + "".join(joints), "rig.toml")


def test_a_rig_without_signs_is_as_it_is_written():
    arm = read("dh", DH, DH).arm
    assert (arm.joints[0].alpha_rad, arm.joints[0].d_m, arm.joints[0].theta_offset_rad) == (0.3, 0.2, 0.4)
    assert arm.base == Pose()


def test_a_sign_turns_the_axis_and_leaves_the_limits_in_the_robots_numbers():
    arm = read("dh", DH, DH + "sign = -1\n").arm
    first, second = arm.joints
    assert (second.d_m, second.theta_offset_rad) == (-0.2, -0.4)
    assert first.alpha_rad == pytest.approx(0.3 - np.pi)
    assert second.alpha_rad == pytest.approx(0.3 - np.pi)
    assert (second.lower_rad, second.upper_rad, second.sign) == (-1.0, 2.0, -1)
    assert arm.base == Pose()


def test_the_first_sign_of_a_table_turns_its_base():
    assert read("dh", DH + "sign = -1\n", DH).arm.base.rotation_rad == pytest.approx((np.pi, 0.0, 0.0))


@pytest.mark.parametrize(
    ("text", "line", "says"),
    [
        (DH + "sign = 0\n", 12, "sign"),
        (DH + "follows = { joint = 1, by = 1.0 }\n", 12, "joint 1 cannot follow joint 1"),
        (DH + "follows = { joint = 2, by = 1.0 }\n", 12, "nearer to the base"),
        (DH + "follows = { by = 1.0 }\n", 12, "joint"),
        (DH + "follows = { joint = 1, with = 1.0 }\n", 12, "with"),
    ],
)
def test_a_sense_that_makes_no_sense_is_refused_at_its_line(text, line, says):
    with pytest.raises(RigFileError, match=says) as refused:
        read("dh", text)
    assert f"line {line}" in str(refused.value)


@pytest.mark.parametrize("by", ["0.5", "0.0", "-2.0", "1e300", "nan"])
def test_controllers_couple_one_to_one(by):
    with pytest.raises(RigFileError, match="by"):
        read("dh", DH, DH + f"follows = {{ joint = 1, by = {by} }}\n")
    assert read("dh", DH, DH + "follows = { joint = 1, by = -1.0 }\n").arm.joints[1].follows.joint == 1


def test_a_base_belongs_to_a_table():
    base = "base = { origin_m = [0, 0, 0.5] }\n"
    assert read("mdh", DH, arm=base).arm.base.origin_m == (0.0, 0.0, 0.5)
    with pytest.raises(RigFileError, match="write it into origin_m and rotation_rad of joint 1"):
        read("local-poe", POE, arm=base)
