import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from simulators.ur.controller_kinematics import (
    IDENTITY,
    NominalArm,
    compose,
    frame_of,
    invert,
    partway,
    pose_of,
    rotation_vector,
    tool_speed,
    twist_to,
)

TOOL = frame_of((0.01, -0.02, 0.15, 0.3, -0.2, 0.5))
vectors = st.tuples(*[st.floats(-3.0, 3.0)] * 3)


def matrix(frame: tuple[float, ...]) -> np.ndarray:
    return np.array(frame[:9]).reshape(3, 3).T


@given(rotation=vectors, shift=vectors)
def test_poses_agree_with_scipy_and_come_back(rotation: tuple, shift: tuple) -> None:
    frame = frame_of((*shift, *rotation))
    expected = Rotation.from_rotvec(rotation)
    assert np.allclose(matrix(frame), expected.as_matrix(), atol=1e-12)
    assert np.allclose(Rotation.from_rotvec(rotation_vector(frame)).as_matrix(), expected.as_matrix(), atol=1e-9)
    assert np.allclose(compose(frame, invert(frame)), IDENTITY, atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, np.pi - 1e-7, np.pi])
@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0.0, -0.8)])
def test_the_rotation_vector_is_exact_near_zero_and_near_half_a_turn(angle: float, axis: tuple) -> None:
    vector = angle * np.array(axis)
    found = np.array(rotation_vector(frame_of((0, 0, 0, *vector))))
    assert min(np.abs(found - vector).max(), np.abs(found + vector).max()) < 1e-9


def test_halfway_is_on_the_line_and_half_turned() -> None:
    start, end = frame_of((0, 0, 0, 0, 0, 0.2)), frame_of((1, 2, 3, 0, 0, 1.0))
    assert pose_of(partway(start, twist_to(start, end), 0.5)) == pytest.approx((0.5, 1, 1.5, 0, 0, 0.6))


def test_the_zero_pose_is_the_one_of_the_drawing(rig: dict) -> None:
    """UR5e: d1 - d5, a2 + a3 and d4 + d6 (Universal Robots, D-H parameters)."""
    pose = pose_of(NominalArm.from_rig(rig).forward([0.0] * 6)[0])
    assert pose[:3] == pytest.approx((-0.8172, -0.2329, 0.0628), abs=1e-12)


def test_the_jacobian_is_the_derivative(rig: dict) -> None:
    arm, q = NominalArm.from_rig(rig), np.array([0.3, -1.2, 1.4, -0.7, 0.9, 0.2])
    J, here = arm.jacobian(q.tolist(), TOOL)
    for joint in range(6):
        step = np.eye(6)[joint] * 1e-6
        there = arm.tool((q + step).tolist(), TOOL)
        assert np.array(twist_to(here, there)) / 1e-6 == pytest.approx(J[:, joint], abs=1e-5)
    qd = [0.1, -0.2, 0.3, 0.4, -0.5, 0.6]
    assert tool_speed(arm.forward(q.tolist())[1], here, qd) == pytest.approx(tuple(J @ qd))


@given(st.tuples(*[st.floats(-0.4, 0.4)] * 6))
def test_the_inverse_finds_back_from_near(rig: dict, offset: tuple) -> None:
    arm, q = NominalArm.from_rig(rig), np.array([0.3, -1.2, 1.4, -0.7, 1.2, 0.2])
    found = arm.inverse(arm.tool(q.tolist(), TOOL), (q + offset).tolist(), TOOL)
    assert found is not None
    assert arm.tool(found.tolist(), TOOL) == pytest.approx(arm.tool(q.tolist(), TOOL), abs=1e-8)


def test_a_pose_out_of_reach_has_no_inverse(rig: dict) -> None:
    assert NominalArm.from_rig(rig).inverse(frame_of((2.0, 0, 0, 0, 0, 0)), [0.1] * 6, TOOL) is None


def test_an_arm_of_another_kind_is_refused_by_name(rig: dict) -> None:
    with pytest.raises(ValueError, match="with 5 joints cannot be driven"):
        NominalArm.from_rig({"arm": {"model": "dh", "joint": rig["arm"]["joint"][:5]}})
