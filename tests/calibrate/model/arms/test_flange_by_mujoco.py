"""The flange of every arm model against MuJoCo, which is given each elementary motion as a body of its own."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import Arm, ArmModel, Joint, Pose, Rig
from calibrate.model.arms.catalogue import ARMS, arm_of

FLANGE = Pose((0.01, -0.02, 0.03), (0.1, 0.2, -0.3))
TABLE = ((0.16, 0.02, 1.5, 0.1), (0.01, -0.42, 0.03, -0.2), (-0.02, -0.39, -0.02, 0.3), (0.13, 0.01, 1.6, 0.0))


def dh_joints():
    names = ("d_m", "a_m", "alpha_rad", "theta_offset_rad")
    return tuple(Joint(-3.0, 3.0, **dict(zip(names, row, strict=True))) for row in TABLE)


def poe_joints():
    origins = ((0.1, 0.2, 0.3), (-0.2, 0.4, 0.1), (0.3, 0.0, -0.1), (0.0, 0.1, 0.2))
    turns = ((0.3, -0.2, 0.1), (1.5, 0.2, 0.0), (0.0, 0.1, -2.0), (-1.0, 1.0, 0.4))
    return tuple(Joint(-3.0, 3.0, origin_m=p, rotation_rad=r) for p, r in zip(origins, turns, strict=True))


def turn(axis, angle):
    return Pose(rotation_rad=tuple(angle * np.eye(3)["xyz".index(axis)]))


def shift(x, z):
    return Pose(origin_m=(x, 0.0, z))


def dh_motions(value):
    for i, (d, a, alpha, offset) in enumerate(TABLE, start=1):
        link = {k: value(f"link{i}.{k}") for k in ("offset", "length", "twist", "tilt")}
        yield turn("z", offset + value(f"joint{i}.zero"))
        yield i
        yield shift(a + link["length"], d + link["offset"])
        yield turn("x", alpha + link["twist"])
        yield turn("y", link["tilt"])
    yield FLANGE


def mdh_motions(value):
    for i, (d, a, alpha, offset) in enumerate(TABLE, start=1):
        link = {k: value(f"link{i - 1}.{k}") for k in ("length", "twist", "tilt")}
        yield turn("x", alpha + link["twist"])
        yield shift(a + link["length"], 0.0)
        yield turn("y", link["tilt"])
        yield turn("z", offset + value(f"joint{i}.zero"))
        yield i
        yield shift(0.0, d + value(f"link{i}.offset"))
    yield FLANGE


def poe_motions(value):
    for i, part in enumerate((*poe_joints(), FLANGE)):
        yield Pose(part.origin_m, part.rotation_rad)
        yield Pose(tuple(value(f"link{i}.{k}") for k in "xyz"))
        yield Pose(rotation_rad=tuple(value(f"link{i}.{k}") for k in ("roll", "pitch", "yaw")))
        if i < 4:
            yield turn("z", value(f"joint{i + 1}.zero"))
            yield i + 1


CASES = {
    ArmModel.DH: (dh_joints, dh_motions),
    ArmModel.MDH: (dh_joints, mdh_motions),
    ArmModel.LOCAL_POE: (poe_joints, poe_motions),
}


def mujoco_arm(motions):
    """A body for every motion, a hinge about z for every number."""
    xml, depth = "", 0
    for motion in motions:
        pose = Pose() if isinstance(motion, int) else motion
        x, y, z, w = Rotation.from_rotvec(pose.rotation_rad).as_quat().tolist()
        origin = " ".join(f"{v!r}" for v in map(float, pose.origin_m))
        xml += (
            f'<body pos="{origin}" quat="{w!r} {x!r} {y!r} {z!r}"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
        )
        xml += f'<joint type="hinge" axis="0 0 1" name="q{motion}"/>' if isinstance(motion, int) else ""
        depth += 1
    return mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{xml}{'</body>' * depth}</worldbody></mujoco>")


def mujoco_flange(model, q):
    data = mujoco.MjData(model)
    data.qpos[:] = q
    mujoco.mj_kinematics(model, data)
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = data.xmat[-1].reshape(3, 3), data.xpos[-1]
    return out


@pytest.mark.parametrize("model", list(ARMS), ids=lambda m: m.value)
@pytest.mark.parametrize("size", [0.0, 0.02], ids=["nominal", "with errors"])
def test_flange_is_that_of_mujoco(model, size):
    joints, motions = CASES[model]
    arm = arm_of(Rig(1, "law", Arm(model, joints(), flange=FLANGE)))
    rng = np.random.default_rng(6)
    theta, q = size * rng.normal(size=len(arm.parameters)), rng.uniform(-3, 3, (20, 4))
    values = {p.name: float(v) for p, v in zip(arm.parameters, theta, strict=True)}
    other = mujoco_arm(motions(lambda name: values.pop(name)))
    assert not values, "every parameter has its place in the chain"
    np.testing.assert_allclose(arm.flange(theta, q), [mujoco_flange(other, row) for row in q], atol=1e-12)
