"""Joint signs of a rig file, taken into the arm's numbers once, where the file is read.

A joint with `sign = -1` is drawn by a table whose axis points the other way than the controller counts. Turning this
axis round, and with it the frame, gives an arm of the same kind that counts as the controller does:
Rz(-q) = Rx(pi) Rz(q) Rx(pi). Everything behind the reader therefore works with the angles that the robot reports, and
no command has to know of signs: zeros, limits, poses and commands are in the robot's own numbers.
Source of the link forms: arms/dh.py, arms/mdh.py, arms/local_poe.py of calibrate.
"""

import math
from collections.abc import Callable

from msgspec.structs import replace

from acquisition.recording.files.bounds import ZERO, Rotation, Vector
from acquisition.recording.rig.schema import Arm, ArmModel, Joint, Pose

Quaternion = tuple[float, float, float, float]  # w, x, y, z

_HALF_TURN: Quaternion = (0.0, 1.0, 0.0, 0.0)  # about x


def arm_as_counted(arm: Arm) -> Arm:
    """The same arm with the axes of all joints of `sign = -1` turned round; the keys `sign` stay as declared."""
    joints, base, flange = list(arm.joints), arm.base, arm.flange
    for i in [i for i, joint in enumerate(arm.joints) if joint.sign < 0]:
        if arm.model is ArmModel.DH:
            joints[i] = _twisted(_mirrored(joints[i]))
            if i == 0:
                base = _turned_behind(base)
            else:
                joints[i - 1] = _turned_com(_twisted(joints[i - 1]))
        elif arm.model is ArmModel.MDH:
            joints[i] = _turned_com(_twisted(_mirrored(joints[i])))
            joints, flange = _turned_next(joints, i + 1, flange, _twisted)
        else:
            joints[i] = _turned_com(_with_pose(joints[i], _turned_behind(_pose(joints[i]))))
            joints, flange = _turned_next(joints, i + 1, flange, lambda j: _with_pose(j, _turned_in_front(_pose(j))))
    return replace(arm, joints=tuple(joints), base=base, flange=flange)


def _turned_next(joints: list[Joint], i: int, flange: Pose, turn: Callable[[Joint], Joint]) -> tuple[list[Joint], Pose]:
    """The part behind a turned joint: that of the next joint, or the flange."""
    if i == len(joints):
        return joints, _turned_in_front(flange)
    return [*joints[:i], turn(joints[i]), *joints[i + 1 :]], flange


def _mirrored(joint: Joint) -> Joint:
    """Offset along the axis and zero count the other way."""
    return replace(joint, d_m=-(joint.d_m or 0.0), theta_offset_rad=-(joint.theta_offset_rad or 0.0))


def _twisted(joint: Joint) -> Joint:
    """Half a turn more of twist, kept within half a turn."""
    alpha_rad = joint.alpha_rad or 0.0
    return replace(joint, alpha_rad=alpha_rad - math.pi if alpha_rad > 0.0 else alpha_rad + math.pi)


def _turned_com(joint: Joint) -> Joint:
    if joint.com_m is None:
        return joint
    x, y, z = joint.com_m
    return replace(joint, com_m=(x, -y, -z))


def _pose(joint: Joint) -> Pose:
    return Pose(joint.origin_m or ZERO, joint.rotation_rad or ZERO)


def _with_pose(joint: Joint, pose: Pose) -> Joint:
    return replace(joint, origin_m=pose.origin_m, rotation_rad=pose.rotation_rad)


def _turned_behind(pose: Pose) -> Pose:
    """T Rx(pi)."""
    return Pose(pose.origin_m, _vector(_product(_quaternion(pose.rotation_rad), _HALF_TURN)))


def _turned_in_front(pose: Pose) -> Pose:
    """Rx(pi) T."""
    x, y, z = pose.origin_m
    origin_m: Vector = (x, -y, -z)
    return Pose(origin_m, _vector(_product(_HALF_TURN, _quaternion(pose.rotation_rad))))


def _quaternion(rotation_rad: Rotation) -> Quaternion:
    angle = math.hypot(*rotation_rad)
    share = 0.5 if angle < 1e-9 else math.sin(0.5 * angle) / angle
    x, y, z = rotation_rad
    return math.cos(0.5 * angle), share * x, share * y, share * z


def _product(a: Quaternion, b: Quaternion) -> Quaternion:
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


def _vector(turn: Quaternion) -> Rotation:
    """The rotation vector of at most half a turn."""
    w, x, y, z = turn if turn[0] >= 0.0 else (-turn[0], -turn[1], -turn[2], -turn[3])
    sine = math.hypot(x, y, z)
    share = 2.0 if sine < 1e-12 else 2.0 * math.atan2(sine, w) / sine
    return share * x, share * y, share * z
