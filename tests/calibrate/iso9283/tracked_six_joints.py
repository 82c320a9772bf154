"""A pose test of the shipped IRB 120 whose zeros and links are off, as a tracker sees it, without any noise."""

import numpy as np
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from acquisition.recording.rig import parse_rig
from calibrate.iso9283.cube import CYCLE, cube_poses_m
from calibrate.model.arms.rig_arm import RigArm
from calibrate.model.model_file import RigIdentity
from calibrate.model.rigid import inverse, transform
from tests.calibrate.apply.correct.six_joints import CHAIN, RIG, model
from tests.calibrate.apply.correct.six_joints import inverse as inverse_kinematics

POINT_M = (0.03, 0.01, 0.08)
DEVICE = ((1.8, -0.7, 0.4), (0.1, 0.2, 2.5))
PLACE = f"[device]\norigin_m = {list(DEVICE[0])}\nrotation_rad = {list(DEVICE[1])}\n\n"
RIG_TEXT = RIG.replace("[tool]\n", f"{PLACE}[tool]\npoint_m = {list(POINT_M)}\n")
RIG_HERE = parse_rig(RIG_TEXT, "rig.toml")
DRAWN, REAL = RigArm.of_rig(RIG_HERE), RigArm.of_rig(RIG_HERE, CHAIN)
TURNED = Rotation.from_rotvec([0.3, -0.2, 1.0]).as_matrix()  # the target on the flange


def known(**changes):
    about = {"tool": POINT_M, "device": (*DEVICE[0], *DEVICE[1])}
    return model(rig=RigIdentity("irb120", "0" * 64, RIG_TEXT), about=about, **changes)


def planned_rad():
    """(5, joint) P1 to P5 of a cube before the arm, with the tool as at its centre."""
    start = np.radians([0.0, 30.0, 20.0, 0.0, 40.0, 0.0])
    middle = DRAWN.frames(start[None])[0, -1]
    places = cube_poses_m(DRAWN.tip_m(start[None])[0], 0.2, "x+")
    goal = np.tile(middle, (5, 1, 1))
    goal[:, :3, 3] += places - places[0]
    q_rad, found = inverse_kinematics().refined(DRAWN, goal, np.tile(start, (5, 1)))
    assert found.all()
    return q_rad


def seen(q_rad, pose=None, off_m=0.0, device=DEVICE, *, turned=False, arm=REAL):
    """Samples of an arm sent to `q_rad` (row, joint): columns cmd, q, repeat where `pose` is given, positions."""
    n = len(q_rad)
    T_base_device = transform(*device)
    flange = arm.frames(q_rad)[:, -1]
    position_m = (arm.tip_m(q_rad) + off_m - T_base_device[:3, 3]) @ T_base_device[:3, :3]
    columns = {"t_s": 20.0 * np.arange(n)}
    columns |= {f"{name}{j + 1}_rad": q_rad[:, j] for name in ("q", "cmd") for j in range(6)}
    columns |= dict(zip(("x_m", "y_m", "z_m"), position_m.T, strict=True))
    if pose is not None:
        columns["repeat"] = np.asarray(pose, dtype=float)
    if turned:
        vector = Rotation.from_matrix(inverse(T_base_device)[:3, :3] @ flange[:, :3, :3] @ TURNED).as_rotvec()
        columns |= dict(zip(("rx_rad", "ry_rad", "rz_rad"), vector.T, strict=True))
    return Samples(columns, 6)


def cycles(count):
    """(row,) numbers of the poses."""
    return np.tile(CYCLE, count)
