"""What a URDF or MJCF file states of torques: against MuJoCo's own inverse dynamics of the file."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import mujoco
import numpy as np
import pytest
from msgspec import structs
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import load_rig
from calibeam.simulation.described_torques import described_torques
from calibrate.diagnose.motion.links_alone import listed_torques, motion_drivers
from calibrate.diagnose.motion.motion_table import planned_motion
from calibrate.errors import DataError
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.parameters import start_values
from calibrate.model.rigid import transform

ROOT = Path(__file__).parents[3]
RIGS = {"six": ROOT / "rigs" / "ur5e-tracker.toml", "seven": ROOT / "calibeam" / "shipped_rigs" / "franka-fr3.toml"}
BASE = transform((0.3, -0.2, 0.5), (0.4, -0.7, 2.0))  # of the rig, in the world of the file
RELATIVE = 1e-6
MESH = '<visual><geometry><mesh filename="no.stl"/></geometry></visual>'


def words(values):
    return " ".join(repr(float(v)) for v in np.ravel(values))


def parts_of(rig, posture_rad, base):
    """Of each joint: its hinge and the body behind it, (4, 4) in the world of the file, at one posture."""
    arm = arm_of(rig)
    frames = base @ arm.frames(start_values(arm.parameters), np.array([posture_rad]))[0]
    return list(pairwise(frames))


def inertial(rng):
    """Mass, centre, orientation of the principal axes, moments of inertia."""
    return rng.uniform(0.5, 5.0), rng.normal(0.0, 0.1, 3), rng.normal(0.0, 1.0, 3), rng.uniform(0.02, 0.035, 3)


def mjcf(rig, rng, senses, zeros_rad, base=BASE, more=""):
    """Each link a body and a lid fixed to it; a finger on the last one; hinges of both senses, drawn off zero."""
    gravity = base[:3, :3] @ rig.arm.gravity_m_s2
    parts = parts_of(rig, zeros_rad, base)
    text, parent = "", np.eye(4)
    for i, (hinge, body) in enumerate(parts):
        pose, turn = np.linalg.inv(parent) @ body, np.linalg.inv(body) @ hinge
        ref = senses[i] * zeros_rad[i]
        text += f'<body pos="{words(pose[:3, 3])}" quat="{quaternion(pose[:3, :3])}"><joint name="j{i + 1}" '
        text += (
            f'pos="{words(turn[:3, 3])}" axis="{words(senses[i] * turn[:3, 2])}" ref="{words(ref)}" {more.format(i)}/>'
        )
        text += weight(rng) + f'<body pos="0.1 0 0" euler="0.3 0.2 0.1">{weight(rng)}</body>'
        parent = body
    text += f'<body pos="0 0 0.1"><joint name="finger" type="slide"/>{weight(rng)}</body>'
    head = f'<compiler angle="radian"/><option gravity="{words(gravity)}"/>'
    return f"<mujoco>{head}<worldbody>{text}{'</body>' * len(parts)}</worldbody></mujoco>"


def weight(rng):
    mass, at, turn, moments = inertial(rng)
    quat = quaternion(Rotation.from_rotvec(turn).as_matrix())
    return f'<inertial mass="{mass!r}" pos="{words(at)}" quat="{quat}" diaginertia="{words(moments)}"/>'


def quaternion(R):
    return words(Rotation.from_matrix(R).as_quat(scalar_first=True))


def urdf(rig, rng, more):
    """Axes along z of frames of their own, with a tool that is fixed to the last link; a mesh that is not there."""
    links, joints, parent = '<link name="base"/>', "", np.eye(4)
    for i, (hinge, _) in enumerate(parts_of(rig, np.zeros(rig.n_joints), np.eye(4)), start=1):
        pose = np.linalg.inv(parent) @ hinge
        links += f'<link name="l{i}">{mass_of(rng)}{MESH}</link>'
        joints += joint(f"j{i}", "continuous", "base" if i == 1 else f"l{i - 1}", f"l{i}", pose, more.format(i))
        parent = hinge
    links += f'<link name="tool">{mass_of(rng)}</link>'
    tool = transform((0.0, 0.02, 0.1), (0.1, 0.0, 0.2))
    return f'<robot name="arm">{links}{joints}{joint("mount", "fixed", f"l{rig.n_joints}", "tool", tool, "")}</robot>'


def joint(name, kind, parent, child, pose, more):
    rpy = Rotation.from_matrix(pose[:3, :3]).as_euler("xyz")
    origin = f'<origin xyz="{words(pose[:3, 3])}" rpy="{words(rpy)}"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{origin}'
        f'<axis xyz="0 0 1"/>{more}</joint>'
    )


def mass_of(rng):
    mass, at, _, moments = inertial(rng)
    x, y, z = (repr(float(v)) for v in moments)
    return (
        f'<inertial><origin xyz="{words(at)}"/><mass value="{mass!r}"/>'
        f'<inertia ixx="{x}" iyy="{y}" izz="{z}" ixy="0.001" ixz="-0.002" iyz="0.0015"/></inertial>'
    )


def moments_of(n, rng, accelerated=True):
    """A motion of moments that have nothing to do with each other; joints never stand."""
    q, qdd = rng.uniform(-2.0, 2.0, (50, n)), accelerated * rng.normal(0.0, 3.0, (50, n))
    qd = rng.uniform(0.3, 2.0, (50, n)) * rng.choice([-1.0, 1.0], (50, n))
    planned = planned_motion(np.arange(50.0), q, qd, qdd, 0.0 * q)
    return replace(planned, torque_nm=0.0 * q, still_rad_s=np.full(n, 1e-9))


def expected(rig, motion, known):
    drivers = motion_drivers(rig, motion, known)
    numbers = np.concatenate([np.ravel(known.links), known.rotors_kg_m2])
    torque = (drivers.link_columns @ numbers).reshape(motion.q_rad.shape)
    return torque + sum(one.at(drivers) for one in listed_torques(known.effects, drivers))


def in_mujoco(path, motion, senses):
    model = mujoco.MjModel.from_xml_path(str(path))
    data, out, n = mujoco.MjData(model), [], len(senses)
    for q, qd, qdd in zip(motion.q_rad, motion.qd_rad_s, motion.qdd_rad_s2, strict=True):
        data.qpos[:n], data.qvel[:n], data.qacc[:n] = senses * q, senses * qd, senses * qdd
        mujoco.mj_inverse(model, data)
        out.append(senses * data.qfrc_inverse[:n])
    return np.array(out)


def eight_joints(rig):
    arm = structs.replace(rig.arm, joints=(*rig.arm.joints, *rig.arm.joints[:2]))
    return structs.replace(rig, arm=arm)


def assert_same(rig, path, motion, senses):
    known = described_torques(path, rig)
    wanted = in_mujoco(path, motion, senses)
    np.testing.assert_allclose(expected(rig, motion, known), wanted, atol=RELATIVE * np.abs(wanted).max())
    return known


@pytest.mark.parametrize("name", RIGS)
def test_mjcf_with_hinges_of_both_senses_other_zeros_and_another_base(name, tmp_path):
    rng, rig = np.random.default_rng(3), load_rig(RIGS[name])
    senses = np.ones(rig.n_joints)
    senses[[1, 4]] = -1.0
    path = tmp_path / "arm.xml"
    more = 'armature="0.1{0}" damping="1.{0}" stiffness="2.{0}" springref="0.{0}"'
    path.write_text(mjcf(rig, rng, senses, rng.uniform(-1.0, 1.0, rig.n_joints), more=more), encoding="utf-8")
    known = assert_same(rig, path, moments_of(rig.n_joints, rng), senses)
    np.testing.assert_allclose(known.gravity_m_s2, rig.arm.gravity_m_s2, atol=1e-9)
    assert any("turn the other way in the file and were reversed: j2, j5" in note for note in known.notes)
    assert any("taken to stand: finger" in note for note in known.notes)


@pytest.mark.parametrize("name", RIGS)
def test_urdf_with_friction_of_its_joints(name, tmp_path):
    rng, rig = np.random.default_rng(4), load_rig(RIGS[name])
    path = tmp_path / "arm.urdf"
    text = urdf(rig, rng, '<dynamics damping="0.{0}" friction="1.{0}"/>')
    path.write_text(text, encoding="utf-8")
    known = described_torques(path, rig)
    (bare := tmp_path / "bare.urdf").write_text(text.replace(MESH, ""), encoding="utf-8")
    motion = moments_of(rig.n_joints, rng, accelerated=False)
    assert_same(rig, bare, motion, np.ones(rig.n_joints))
    assert known.links == described_torques(bare, rig).links
    assert len(known.effects) == 2 * rig.n_joints


def test_what_mujoco_switches_off_is_off(tmp_path):
    rng, rig = np.random.default_rng(5), load_rig(RIGS["six"])
    text = mjcf(rig, rng, np.ones(6), np.zeros(6), more='damping="1.{0}" stiffness="2"')
    off = text.replace("/><worldbody>", '><flag gravity="disable" damper="disable"/></option><worldbody>')
    (path := tmp_path / "arm.xml").write_text(off, encoding="utf-8")
    known = assert_same(rig, path, moments_of(6, rng), np.ones(6))
    assert known.gravity_m_s2 == (0.0, 0.0, 0.0)


def test_an_arm_that_is_not_that_of_the_rig_is_refused(tmp_path):
    rng, rig = np.random.default_rng(6), load_rig(RIGS["six"])
    (path := tmp_path / "arm.xml").write_text(mjcf(rig, rng, np.ones(6), np.zeros(6)), encoding="utf-8")
    with pytest.raises(DataError, match=r"arm\.xml: joint finger is no hinge"):
        described_torques(path, load_rig(RIGS["seven"]))
    with pytest.raises(DataError, match=r"arm\.xml: at most 7 joints in a row, and the rig file has one arm of 8;"):
        described_torques(path, eight_joints(rig))
    off = np.array([0.0, 0.0, 0.3, 0.0, 0.0, 0.0])
    text = mjcf(rig, rng, np.ones(6), off).replace(f'ref="{0.3!r}"', 'ref="0"')
    path.write_text(text, encoding="utf-8")
    with pytest.raises(DataError, match=r"arm\.xml: the axis of joint j\d is .* mm and .* mrad from joint \d of the"):
        described_torques(path, rig)
