"""A rig from a URDF moves as the URDF does: against a product of its own joints in this file, and against MuJoCo."""

from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

from acquisition.recording.rig import parse_rig
from calibeam.new_rig.drawn import poe_text
from calibeam.new_rig.from_urdf import urdf_arm
from calibrate.errors import DataError
from calibrate.model.arms.rig_arm import RigArm

ARM = """<?xml version="1.0"?>
<robot name="crooked">
  <mujoco><compiler balanceinertia="true" discardvisual="true" fusestatic="true"/></mujoco>
  <link name="world"/>
  <link name="base"/>
  <link name="one">{one}</link>
  <link name="two">{two}</link>
  <link name="cover">{cover}</link>
  <link name="three">{three}</link>
  <link name="sensor"/>
  <link name="tool0"/>
  <joint name="stand" type="fixed"><parent link="world"/><child link="base"/>
    <origin xyz="0.1 -0.2 0.3" rpy="0.1 0.2 -0.3"/></joint>
  <joint name="a" type="revolute"><parent link="base"/><child link="one"/>
    <origin xyz="0 0 0.4"/><axis xyz="0 0 -1"/><limit lower="-2.9" upper="2.5" effort="0" velocity="1"/></joint>
  <joint name="b" type="revolute"><parent link="one"/><child link="two"/>
    <origin xyz="0.05 0.01 0.02" rpy="1.5707963 0.3 0"/><axis xyz="1 2 2"/>
    <limit lower="-1" upper="1.2" effort="0" velocity="1"/></joint>
  <joint name="lid" type="fixed"><parent link="two"/><child link="cover"/>
    <origin xyz="0.1 0 0.2" rpy="0 0 1"/></joint>
  <joint name="c" type="continuous"><parent link="two"/><child link="three"/>
    <origin xyz="0.3 0 0" rpy="0 -1.2 0.4"/></joint>
  <joint name="end" type="fixed"><parent link="three"/><child link="tool0"/>
    <origin xyz="0.02 0.03 0.1" rpy="0 1.5707963267948966 0"/></joint>
  <joint name="other" type="fixed"><parent link="three"/><child link="sensor"/>
    <origin xyz="0 0 0.1"/></joint>
</robot>"""
MASS = (
    '<inertial><origin xyz="{}"/><mass value="{}"/>'
    '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'
)
MASSES = {
    "one": MASS.format("0.01 0.02 0.1", 3.0),
    "two": MASS.format("0.1 0 0.05", 2.0),
    "cover": MASS.format("0 0.03 0", 0.5),
    "three": MASS.format("0 0 0.04", 1.0),
}


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.format(**MASSES), encoding="utf-8")
    return path


def written(path, *ends):
    return parse_rig(poe_text(urdf_arm(path, *ends)), "rig.toml")


def readings(count, seed=1):
    return np.random.default_rng(seed).uniform([-2.9, -1.0, -3.0], [2.5, 1.2, 3.0], (count, 3))


def product(text, names, q_rad):
    """T of the last joint's child in the first one's parent: origin, then Rodrigues' turn about the axis."""
    joints = {joint.get("name"): joint for joint in ElementTree.fromstring(text).findall("joint")}
    T, angles = np.eye(4), iter(q_rad)
    for name in names:
        origin, axis = joints[name].find("origin"), joints[name].find("axis")
        r, p, y = map(float, origin.get("rpy", "0 0 0").split())
        cr, sr, cp, sp, cy, sy = np.cos(r), np.sin(r), np.cos(p), np.sin(p), np.cos(y), np.sin(y)
        own = np.eye(4)
        own[:3, :3] = (
            np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
            @ np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
            @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
        )
        own[:3, 3] = list(map(float, origin.get("xyz").split()))
        T = T @ own
        if joints[name].get("type") != "fixed":
            x, y, z = k = np.array(list(map(float, (axis.get("xyz") if axis is not None else "1 0 0").split())))
            K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) / np.linalg.norm(k)
            angle = next(angles)
            turn = np.eye(4)
            turn[:3, :3] += np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K
            T = T @ turn
    return T


@pytest.mark.parametrize(
    ("ends", "names"),
    [((), ("stand", "a", "b", "c", "end")), (("base", "sensor"), ("a", "b", "c", "other"))],
    ids=["whole", "between two links"],
)
def test_a_rig_moves_as_its_urdf_does(file, ends, names):
    rig = written(file, *ends)
    arm, text = RigArm.of_rig(rig), file.read_text()
    for q_rad in readings(100):
        np.testing.assert_allclose(arm.flange(q_rad), product(text, names, q_rad), atol=1e-9)


def test_limits_masses_and_centres_come_along_as_mujoco_has_them(file):
    rig = written(file)
    arm = RigArm.of_rig(rig)
    assert [(j.lower_rad, j.upper_rad) for j in rig.arm.joints[:2]] == [(-2.9, 2.5), (-1.0, 1.2)]
    assert rig.arm.joints[2].upper_rad == pytest.approx(2 * np.pi)
    model = mujoco.MjModel.from_xml_string(file.read_text())
    data = mujoco.MjData(model)
    for q_rad in readings(20, seed=2):
        data.qpos[:] = q_rad
        mujoco.mj_forward(model, data)
        frames, moment = arm.frames(q_rad[None])[0], np.zeros(3)
        for i, joint in enumerate(rig.arm.joints):
            c, s = np.cos(q_rad[i]), np.sin(q_rad[i])
            turned = frames[i, :3, :3] @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
            moment += joint.mass_kg * (turned @ np.array(joint.com_m) + frames[i, :3, 3])
        np.testing.assert_allclose(moment, model.body_mass.sum() * data.subtree_com[0], atol=1e-9)
        assert sum(j.mass_kg for j in rig.arm.joints) == pytest.approx(model.body_mass.sum())


@pytest.mark.parametrize(
    ("wrong", "right", "says"),
    [
        ('<?xml version="1.0"?>', '<!DOCTYPE robot [<!ENTITY a "aaa">]>', "DOCTYPE is refused"),
        ('type="continuous"', 'type="prismatic"', "joint c is 'prismatic'"),
        ('lower="-1" upper="1.2"', 'lower="1.2" upper="-1"', "limits 1.2 to -1 rad hold no angle"),
        ('axis xyz="1 2 2"', 'axis xyz="0 0 0"', "give a direction"),
        ('xyz="0.3 0 0"', 'xyz="0.3 nan 0"', "finite numbers"),
        ('child link="two"', 'child link="nothing"', "which is not there"),
        ('name="crooked"', 'name="crooked" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:a/', "expand it first"),
        ("</robot>", "", "no XML"),
    ],
)
def test_what_cannot_be_an_arm_is_refused_with_a_reason(file, wrong, right, says):
    text = file.read_text()
    assert wrong in text
    file.write_text(text.replace(wrong, right))
    with pytest.raises(DataError, match=says) as refused:
        written(file)
    assert len(str(refused.value)) < 600


def test_an_unknown_link_and_a_tip_that_does_not_hang_on_the_base_are_named(file):
    with pytest.raises(DataError, match="no link nowhere"):
        written(file, None, "nowhere")
    with pytest.raises(DataError, match="does not hang on"):
        written(file, "three", "base")
