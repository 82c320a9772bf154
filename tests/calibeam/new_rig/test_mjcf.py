"""A rig from an MJCF model moves as MuJoCo moves the model."""

import mujoco
import numpy as np
import pytest

from acquisition.recording.rig import parse_rig
from calibeam.new_rig.drawn import poe_text
from calibeam.new_rig.from_mjcf import mjcf_arm
from calibrate.errors import DataError
from calibrate.model.arms.rig_arm import RigArm

ARM = """<mujoco model="crooked">
  <compiler angle="radian" autolimits="true"/>
  <worldbody>
    <body name="stand" pos="0.1 0 0.2" euler="0.1 0 0">
      <body name="one" pos="0 0 0.3">
        <joint name="a" axis="0 0 1" range="-2 2"/>
        <geom type="sphere" size="0.05" mass="3" pos="0 0.1 0.1"/>
        <body name="two" pos="0.1 0 0.2" quat="0.9 0.1 0.3 0.2">
          <joint name="b" axis="0 1 1" pos="0.02 0 0.01" ref="0.3" range="-1 1"/>
          <joint name="c" axis="-1 0 0"/>
          <geom type="sphere" size="0.05" mass="1" pos="0.2 0 0"/>
          <body name="lid" pos="0 0 0.1"><geom type="sphere" size="0.02" mass="0.5" pos="0.01 0 0"/></body>
          <site name="tip" pos="0.3 0 0.05" euler="0 0.5 0"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(ARM)
    return path


def test_a_rig_moves_as_mujoco_does(file):
    rig = parse_rig(poe_text(mjcf_arm(file, None, "tip")), "rig.toml")
    arm, model = RigArm.of_rig(rig), mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    for q_rad in np.random.default_rng(4).uniform(-1.0, 1.0, (100, 3)):
        data.qpos[:] = q_rad
        mujoco.mj_forward(model, data)
        T, site = arm.flange(q_rad), data.site("tip")
        np.testing.assert_allclose(T[:3, 3], site.xpos, atol=1e-9)
        np.testing.assert_allclose(T[:3, :3], site.xmat.reshape(3, 3), atol=1e-9)
        frames, moment = arm.frames(q_rad[None])[0], np.zeros(3)
        for i, joint in enumerate(rig.arm.joints):
            c, s = np.cos(q_rad[i]), np.sin(q_rad[i])
            turned = frames[i, :3, :3] @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
            com = np.zeros(3) if joint.com_m is None else np.array(joint.com_m)
            moment += (joint.mass_kg or 0.0) * (turned @ com + frames[i, :3, 3])
        np.testing.assert_allclose(moment, 4.5 * data.subtree_com[0], atol=1e-9)
    assert [(j.lower_rad, j.upper_rad) for j in rig.arm.joints[:2]] == [(-2.0, 2.0), (-1.0, 1.0)]


def test_what_mujoco_cannot_load_and_a_slide_are_refused(file):
    file.write_text(ARM.replace('name="c"', 'name="c" type="slide"'))
    with pytest.raises(DataError, match="c is no hinge"):
        mjcf_arm(file)
    file.write_text("<mujoco>")
    with pytest.raises(DataError, match=r"no XML: .*; give a whole MJCF file"):
        mjcf_arm(file)
    file.write_text("<mujoco><nothing/></mujoco>")
    with pytest.raises(DataError, match="MuJoCo cannot load it"):
        mjcf_arm(file)
    with pytest.raises(DataError, match="no such file"):
        mjcf_arm(file.with_name("none.xml"))
