"""The arm that a controller computes with is found from its poses: what differs, and nothing else."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import load_rig
from calibrate.errors import DataError
from calibrate.fit.controller_arm import ControllerPoses, controller_arm
from calibrate.model.rigid import transform
from simulators.ur.controller_kinematics import Link, NominalArm, frame_of

ROOT = Path(__file__).parents[3]
RIG = load_rig(ROOT / "rigs" / "ur5e-dual-psd.toml")
PANDA = load_rig(ROOT / "calibeam" / "shipped_rigs" / "franka-panda.toml")
SHARED = ROOT.parent / "shared" / "data" / "panda-sockets" / "placements"
TOOL = (0.01, -0.02, 0.15, 0.0, 0.0, -np.pi / 4)
BASE = (0.0, 0.0, 0.003, 0.0, 0.0, 0.002)
Q = np.random.default_rng(7).uniform(-2.0, 2.0, (80, 6))


def links(**changed):
    """The rows of the rig, as the controller has them: `d3_m=1e-3` adds to d of joint 3."""
    out = []
    for i, j in enumerate(RIG.arm.joints, start=1):
        names = ("a_m", "alpha_rad", "d_m", "theta_offset_rad")
        out.append(Link(*((getattr(j, n) or 0.0) + changed.get(f"{n.split('_')[0]}{i}", 0.0) for n in names)))
    return out


def poses(arm, tool=TOOL, base=(0.0,) * 6, *, stated=False, noise=0.0, at=Q):
    T_tool, rng = frame_of(tool), np.random.default_rng(8)
    T = np.array([_matrix(arm.tool(q.tolist(), T_tool)) for q in at])
    T = transform(np.array(base[:3]), np.array(base[3:])) @ T
    T[:, :3, 3] += noise * rng.normal(size=(len(at), 3))
    T[:, :3, :3] = Rotation.from_rotvec(noise * rng.normal(size=(len(at), 3))).as_matrix() @ T[:, :3, :3]
    tools = np.tile(_matrix(T_tool), (len(Q), 1, 1)) if stated else None
    return ControllerPoses(at, T, tools, "stream robot")


def _matrix(frame):
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = np.array(frame[:9]).reshape(3, 3).T, frame[9:]
    return out


def named(found):
    return {d.name: d for d in found.differences}


@pytest.mark.parametrize("stated", [False, True])
@pytest.mark.parametrize("noise", [0.0, 1e-6])
def test_the_same_arm_differs_in_nothing(stated, noise):
    found = controller_arm(RIG, poses(NominalArm(links()), stated=stated, noise=noise))
    assert found.parts == ()
    assert found.differences == ()
    assert found.other_tool
    assert np.allclose(found.T_flange_tool, _matrix(frame_of(TOOL)), atol=1e-8 + 2.0 * noise)


def test_a_bare_flange_and_the_point_of_the_rig_are_no_other_tool():
    assert not controller_arm(RIG, poses(NominalArm(links()), (0.0,) * 6)).other_tool


def test_a_base_that_is_moved_is_the_base_alone():
    found = controller_arm(RIG, poses(NominalArm(links()), base=BASE))
    assert found.parts == ("base",)
    assert set(named(found)) == {"base.z", "base.rz"}
    assert named(found)["base.z"].value == pytest.approx(0.003, abs=1e-8)
    assert named(found)["base.rz"].value == pytest.approx(0.002, abs=1e-8)


@pytest.mark.parametrize("noise", [0.0, 1e-6])
def test_zeros_of_inner_joints_are_found(noise):
    arm = NominalArm(links(theta2=1e-3, theta5=-2e-3))
    found = controller_arm(RIG, poses(arm, stated=True, noise=noise))
    assert found.parts == ("zeros",)
    assert set(named(found)) == {"joint2.zero", "joint5.zero"}
    for name, true in (("joint2.zero", 1e-3), ("joint5.zero", -2e-3)):
        one = named(found)[name]
        assert abs(one.value - true) < 5.0 * one.sigma + 1e-10
        assert one.sigma < 2.0 * noise + 1e-8


def test_a_factory_calibration_is_found_and_predicts_other_postures():
    """Lengths and twists of every link: what two parallel axes share is not determined, and is given no number."""
    changed = {
        "a2": 4e-4,
        "a3": -3e-4,
        "d1": 2e-4,
        "d5": -3e-4,
        "alpha1": 3e-4,
        "alpha4": -5e-4,
        "theta3": 1e-3,
        "d4": 1e-4,
    }
    arm = NominalArm(links(**changed))
    found = controller_arm(RIG, poses(arm, stated=True))
    assert found.parts == ("zeros", "links")
    assert named(found)["link2.length"].value == pytest.approx(4e-4, abs=1e-7)
    assert named(found)["joint3.zero"].value == pytest.approx(1e-3, abs=1e-7)
    assert {"link2.offset", "link3.offset", "link4.offset"}.isdisjoint(named(found))
    assert any("link3.offset" in why for why in found.undetermined)
    assert found.left_m < 1e-9


SIDEWAYS = (0.04, 0.0, 0.0, 0.0, 0.0, 0.0)


def about(joint):
    """Postures in which this joint alone turns."""
    q = np.tile([0.3, -1.0, 1.1, -0.5, 0.7, 0.2], (len(Q), 1))
    q[:, joint - 1] = np.linspace(-2.0, 2.0, len(Q))
    return q


@pytest.mark.parametrize("noise", [0.0, 1e-6])
def test_the_tool_has_sigmas_that_hold_its_errors(noise):
    found = controller_arm(RIG, poses(NominalArm(links()), base=BASE, noise=noise))
    apart = np.abs(found.T_flange_tool[:3, 3] - np.array(TOOL[:3]))
    assert np.all(apart < 5.0 * found.tool_sigma[:3] + 1e-10)
    assert np.all(found.tool_sigma < 2.0 * noise + 1e-8)


@pytest.mark.parametrize("noise", [0.0, 1e-5])
@pytest.mark.parametrize("joint", [1, 6])
@pytest.mark.parametrize("tool", [SIDEWAYS, TOOL])
@pytest.mark.parametrize("base", [(0.0,) * 6, (0.01, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.003, 0.01, 0.0, 0.0), BASE])
def test_poses_about_one_axis_give_no_number_that_they_do_not_determine(tool, base, joint, noise):
    """Base and tool turn against each other about that axis; what is stated all the same is true."""
    found = controller_arm(RIG, poses(NominalArm(links()), tool, base, noise=noise, at=about(joint)))
    assert not np.isfinite(found.tool_sigma[:3]).all()
    for one in found.differences:
        true = dict(zip((f"base.{axis}" for axis in ("x", "y", "z", "rx", "ry", "rz")), base, strict=True))[one.name]
        assert abs(one.value - true) < 5.0 * one.sigma + 1e-8, one
    known = np.isfinite(found.tool_sigma[:3])
    apart = np.abs(found.T_flange_tool[:3, 3] - np.array(tool[:3]))
    assert np.all(apart[known] < 5.0 * found.tool_sigma[:3][known] + 1e-8)


def test_a_base_that_is_moved_is_told_although_no_number_of_it_is_determined():
    found = controller_arm(RIG, poses(NominalArm(links()), SIDEWAYS, BASE, at=about(6)))
    assert found.parts == ("base",)
    assert found.differences == ()


def test_a_pose_that_was_written_at_another_time_is_left_out():
    given = poses(NominalArm(links()), stated=True, noise=1e-6)
    given.T_base_tool[[3, 40], 0, 3] += 0.01
    found = controller_arm(RIG, given)
    assert found.left_out == 2
    assert found.parts == ()


def test_few_poses_are_refused():
    given = poses(NominalArm(links())).rows(np.arange(len(Q)) < 19)
    with pytest.raises(DataError, match="stream robot: 19 different poses of the controller's tool; give 20"):
        controller_arm(RIG, given)


def test_the_panda_of_the_sockets_computes_with_the_published_arm_and_its_hand():
    """Quaternions w, x, y, z; the tool is what the maker states for the hand: 103.4 mm, -45 degrees."""
    if not SHARED.is_dir():
        pytest.skip("real data not found in ../shared/data beside the project")
    files = [(q, q.with_name(f"{q.stem}_pose.csv")) for q in sorted(SHARED.glob("*/hole_?.csv"))]
    read = [(np.loadtxt(q, delimiter=","), np.loadtxt(pose, delimiter=",")) for q, pose in files]
    read = [(q, pose) for q, pose in read if len(q) == len(pose)]  # two files lack rows of the other
    q_rad, pose = (np.concatenate(part) for part in zip(*read, strict=True))
    T = np.tile(np.eye(4), (len(pose), 1, 1))
    T[:, :3, 3], T[:, :3, :3] = pose[:, :3], Rotation.from_quat(pose[:, 3:], scalar_first=True).as_matrix()
    found = controller_arm(PANDA, ControllerPoses(q_rad, T, None, "samples"))
    assert found.parts == ()
    assert found.other_tool
    assert np.allclose(found.T_flange_tool[:3, 3], [0.0, 0.0, 0.1034], atol=2e-5)
    turn = Rotation.from_matrix(found.T_flange_tool[:3, :3]).as_euler("xyz", degrees=True)
    assert np.allclose(turn, [0.0, 0.0, -45.0], atol=0.02)
    assert found.left_m < 5e-5
