"""A controller that counts joints against the rig ends in an error that names them, and never in a mirrored model."""

import msgspec
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import load_rig
from calibrate.errors import DataError
from calibrate.fit.identify.identify import identify
from calibrate.fit.identify.session import instruments_for_fit
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.parameters import start_values
from tests.calibrate.fit.identify.conftest import SHIFT, TURN, changed, table

TOOL = np.array([0.03, 0.0, 0.08])
POSITION = ("x_m", "y_m", "z_m")
NOISE_M = 2e-5


@pytest.fixture(scope="module")
def planar_rig(request):
    """An IRB 120, whose links move in one plane as a KUKA's do."""
    drawn = load_rig(request.config.rootpath / "rigs" / "irb120-modbus.toml")
    tool = msgspec.structs.replace(drawn.tool, point_m=tuple(TOOL))
    return msgspec.structs.replace(drawn, tool=tool)


def tips(rig, q):
    """(row, 3) in the base of an arm with zeros and lengths beside the drawing, link by link (standard D-H)."""
    rng = np.random.default_rng(12)
    point = np.tile(TOOL, (len(q), 1))
    for j, joint in reversed(list(enumerate(rig.arm.joints))):
        zero, a, d = rng.normal(0.0, 2e-3), joint.a_m + rng.normal(0.0, 3e-4), joint.d_m + rng.normal(0.0, 3e-4)
        point = Rotation.from_rotvec([joint.alpha_rad, 0, 0]).apply(point) + np.array([a, 0.0, d])
        angle = q[:, j] + joint.theta_offset_rad + zero
        point = Rotation.from_rotvec(angle[:, None] * [0, 0, 1]).apply(point)
    return point


def session(rig, n=120, joints=()):
    """Samples of a tracker; the file counts these joints against the rig."""
    rng = np.random.default_rng(7)
    q = rng.uniform(-1.7, 1.1, (n, 6))
    seen = TURN.inv().apply(tips(rig, q) - SHIFT) + rng.normal(0.0, NOISE_M, (n, 3))
    sign = np.where(np.isin(np.arange(1, 7), joints), -1.0, 1.0)
    return table(q * sign, **dict(zip(POSITION, seen.T, strict=True)))


def negated(samples, *names):
    return changed(samples, **{name: -samples.column(name) for name in names})


def run(rig, samples):
    return identify(rig, samples, rng=np.random.default_rng(0), held_out_share=0.0)


def test_a_kuka_is_refused_by_its_joints_and_good_once_these_are_mended(planar_rig):
    samples = session(planar_rig, joints=(1, 4, 6))
    with pytest.raises(DataError, match="joints 1, 4 and 6 turn against the rig's sense") as refused:
        run(planar_rig, samples)
    assert "write sign = -1 for joints 1, 4 and 6, as for KUKA" in str(refused.value)
    assert "left-handed" not in str(refused.value)
    mended = run(planar_rig, negated(samples, "q1_rad", "q4_rad", "q6_rad"))
    assert mended.instruments[0].rms_distance_after_m < 2.0 * NOISE_M
    assert mended.alarms == ()


def test_a_negated_column_of_the_device_is_refused_too(planar_rig):
    samples = session(planar_rig)
    with pytest.raises(DataError, match=r"joints 1, 4 and 6.*less likely: one of x_m, y_m, z_m is negated"):
        run(planar_rig, negated(samples, "x_m"))
    assert run(planar_rig, samples).instruments[0].rms_distance_after_m < 2.0 * NOISE_M


@pytest.mark.parametrize("wrong", ["joints", "column"])
def test_few_poses_do_not_pass_as_a_mirror_image(planar_rig, wrong):
    samples = session(planar_rig, 11, (1, 4, 6)) if wrong == "joints" else negated(session(planar_rig, 11), "x_m")
    with pytest.raises(DataError, match="only the mirror image of the positions fits"):
        run(planar_rig, samples)


@pytest.mark.parametrize("poses", [6, 40])
def test_millimetres_are_refused_however_few_the_poses(planar_rig, poses):
    samples = session(planar_rig, poses)
    millimetres = changed(samples, **{name: 1e3 * samples.column(name) for name in POSITION})
    with pytest.raises(DataError, match=r"positions in millimetres.*write metres"):
        run(planar_rig, millimetres)


@pytest.mark.parametrize("joints", [(), (1, 4, 6), (2,)])
def test_the_frame_of_a_device_is_a_rotation_whatever_the_file_says(planar_rig, joints):
    found = instruments_for_fit(planar_rig, session(planar_rig, joints=joints)).alignment
    assert np.linalg.det(found.T_a_b[:3, :3]) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("joint", range(2, 7))
def test_an_axis_turned_round_in_the_rig_is_the_same_as_a_negated_column(planar_rig, joint):
    """The table of docs/formats.md, Joint signs: half a turn more of alpha on both sides, d and offset negated."""
    joints = list(planar_rig.arm.joints)
    before, own = joints[joint - 2], joints[joint - 1]
    joints[joint - 2] = msgspec.structs.replace(before, alpha_rad=before.alpha_rad + np.pi)
    joints[joint - 1] = msgspec.structs.replace(
        own, alpha_rad=own.alpha_rad + np.pi, d_m=-own.d_m, theta_offset_rad=-own.theta_offset_rad
    )
    turned = msgspec.structs.replace(planar_rig, arm=msgspec.structs.replace(planar_rig.arm, joints=tuple(joints)))
    q = np.random.default_rng(2).uniform(-2.0, 2.0, (20, 6))
    arm, other = arm_of(planar_rig), arm_of(turned)
    sign = np.where(np.arange(1, 7) == joint, -1.0, 1.0)
    there = arm.flange(start_values(arm.parameters), q)
    np.testing.assert_allclose(other.flange(start_values(other.parameters), q * sign), there, atol=1e-12)
