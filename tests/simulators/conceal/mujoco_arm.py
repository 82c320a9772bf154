"""The same arm built in MuJoCo: another author's mechanics, to check deflections and frames against."""

import math

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from simulators.arm.kinematics import Arm

PLACE = 'pos="{0[0]!r} {0[1]!r} {0[2]!r}" quat="{1[0]!r} {1[1]!r} {1[2]!r} {1[3]!r}"'
MASS = '<inertial pos="{0[0]!r} {0[1]!r} {0[2]!r}" mass="{1!r}" diaginertia="0.05 0.05 0.05"/>'


def place(pose: np.ndarray) -> str:
    quaternion = Rotation.from_matrix(pose[:3, :3]).as_quat(scalar_first=True)
    return PLACE.format(pose[:3, 3].tolist(), quaternion.tolist())


def build(
    arm: Arm, joint_rad: np.ndarray, springs_nm_rad: dict[int, float], pedestal_nm_rad: float | None = None
) -> mujoco.MjModel:
    """The arm clamped at `joint_rad` (n,); where asked, beyond the clamp of joint i a sprung hinge, and a foot."""
    text = ""
    for joint in range(arm.n_joints):
        clamped = arm.fixed[joint].copy()
        clamped[:3, :3] = clamped[:3, :3] @ Rotation.from_rotvec([0.0, 0.0, joint_rad[joint]]).as_matrix()
        text += f"<body {place(clamped)}>"
        if joint + 1 in springs_nm_rad:
            stiffness = springs_nm_rad[joint + 1]
            damping = 2.0 * math.sqrt(stiffness * 3.0)
            text += f'<joint axis="0 0 1" stiffness="{stiffness!r}" damping="{damping!r}"/>'
        text += MASS.format(arm.com_m[joint].tolist(), float(max(arm.mass_kg[joint], 1e-9)))
    text += f"<body {place(arm.fixed[-1])}>" + MASS.format(arm.tool_com_m.tolist(), arm.tool_kg)
    text += '<site name="flange"/></body>' + "</body>" * arm.n_joints
    if pedestal_nm_rad is not None:
        hinges = "".join(
            f'<joint axis="{axis}" stiffness="{pedestal_nm_rad!r}" damping="3000"/>' for axis in ("1 0 0", "0 1 0")
        )
        text = f'<body>{hinges}<inertial pos="0 0 0" mass="1e-9" diaginertia="5 5 5"/>{text}</body>'
    option = (
        '<option timestep="0.001" integrator="implicitfast"><flag contact="disable" constraint="disable"/></option>'
    )
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><compiler angle="radian" balanceinertia="false"/>{option}<worldbody>{text}</worldbody></mujoco>'
    )


def settled_flange(model: mujoco.MjModel, seconds: float) -> np.ndarray:
    """T_base_flange when every spring has come to rest."""
    data = mujoco.MjData(model)
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    return flange(model, data)


def flange(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    site = model.site("flange").id
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = data.site_xmat[site].reshape(3, 3), data.site_xpos[site]
    return pose
