"""URDF and MJCF of an identified arm: links and joints as XML.

URDF: fixed base, turning joints, a fixed flange and, where known, the tool point. Source of the form: ROS wiki,
urdf/XML/joint: origin first (xyz in m, rpy in rad about fixed axes), then the turn about `axis`. `effort` is obligatory
there and no matter of calibration: 0 means nothing.

MJCF, for MuJoCo: geometry, masses, what a motion has shown of torques (mjcf_torques.py), and linear joint stiffness, so
that it sags. Behind a soft joint stands a second
hinge about the same axis with the stiffness found and its rest at zero: `joint3` is the drive, whose angle is the
reading, `joint3_spring` what the gear yields under load. Source of the form: MuJoCo documentation, XML reference, body,
joint (stiffness, springref, armature), inertial.
"""

from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import ArmModel
from calibrate.apply.export.identified import IdentifiedArm, roll_pitch_yaw
from calibrate.apply.export.mjcf_torques import Body, moving_arm
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.parameters import values_by_name
from calibrate.model.rigid import inverse, transform

Floats = NDArray[np.float64]


def urdf_text(arm: IdentifiedArm) -> str:
    """The file's text; numbers in full precision."""
    n = arm.rig.n_joints
    links = ["base", *(f"link{i}" for i in range(1, n + 1)), "flange"]
    lines = [f"  <!-- Identified by calibeam. m and rad; {arm.sign}. -->"]
    # XML ends a comment at two hyphens
    lines += [f"  <!-- {says.replace('--', '- -')} -->" for says in arm.not_carried]
    for i, (low, high) in enumerate(arm.limits_rad, start=1):
        limit = f'<limit lower="{low!r}" upper="{high!r}" effort="0" velocity="{arm.rig.motion.speed_rad_s!r}"/>'
        lines += _joint(f"joint{i}", "revolute", (links[i - 1], links[i]), arm.parts[i - 1])
        lines += ['    <axis xyz="0 0 1"/>', f"    {limit}", "  </joint>"]
    lines += [*_joint("flange_fixed", "fixed", (links[n], "flange"), arm.parts[n]), "  </joint>"]
    if arm.tool_m is not None:
        T_flange_tool = np.eye(4)
        T_flange_tool[:3, 3] = arm.tool_m
        links.append("tool_point")
        lines += [*_joint("tool_point_fixed", "fixed", ("flange", "tool_point"), T_flange_tool), "  </joint>"]
    lines[1:1] = [f'  <link name="{name}"/>' for name in links]
    name = quoteattr(arm.rig.name)
    return "\n".join(['<?xml version="1.0"?>', f"<robot name={name}>", *lines, "</robot>", ""])


def _joint(name: str, kind: str, links: tuple[str, str], T_parent_child: Floats) -> list[str]:
    xyz = " ".join(repr(v) for v in T_parent_child[:3, 3].tolist())
    rpy = " ".join(repr(v) for v in roll_pitch_yaw(T_parent_child[:3, :3]))
    return [
        f'  <joint name="{name}" type="{kind}">',
        f'    <parent link="{links[0]}"/>',
        f'    <child link="{links[1]}"/>',
        f'    <origin xyz="{xyz}" rpy="{rpy}"/>',
    ]


NO_PAYLOAD = "A payload is not in this file: attach its mass to the body flange, and soft joints yield to it."
SPRING = "_spring"
AT_REST = ' armature="1"'  # without known rotors: inertia moves no arm that stands
DAMPING_S = 0.1  # of stiffness: springs come to rest within seconds and do not ring
LEAST = '<compiler angle="radian" boundmass="1e-6" boundinertia="1e-6"/>'  # what states no mass still can move


def mjcf_text(arm: IdentifiedArm) -> str:
    """The file's text; numbers in full precision."""
    moving = None if arm.torques is None else moving_arm(arm.rig, arm.torques)
    not_carried = (*arm.not_carried, *(() if moving is None else moving.not_carried))
    lines = [
        f"<mujoco model={quoteattr(arm.rig.name)}>",
        f"  <!-- Identified by calibeam. m, rad, kg; {arm.sign}. -->",
        *(f"  <!-- {says.replace('--', '- -')} -->" for says in not_carried),
        *([f"  <!-- {NO_PAYLOAD} -->"] if moving is None else []),
        f"  {LEAST}",
        f'  <option gravity="{_numbers(arm.rig.arm.gravity_m_s2 if moving is None else moving.gravity_m_s2)}"/>',
        "  <worldbody>",
    ]
    indent = "    "
    for i, (joint, (low, high)) in enumerate(zip(arm.rig.arm.joints, arm.limits_rad, strict=True), start=1):
        lines.append(f'{indent}<body name="link{i}"{_pose(arm.parts[i - 1])}>')
        indent += "  "
        lines.append(
            f'{indent}<joint name="joint{i}" type="hinge" axis="0 0 1" limited="true" range="{low!r} {high!r}"'
            f"{AT_REST if moving is None else moving.joints[i - 1].text}/>"
        )
        if i in arm.compliance_rad_nm:
            stiffness = 1.0 / arm.compliance_rad_nm[i]
            lines += [
                f'{indent}<inertial pos="0 0 0" mass="1e-6" diaginertia="1e-6 1e-6 1e-6"/>',
                f'{indent}<body name="link{i}_output">',
            ]
            indent += "  "
            lines.append(
                f'{indent}<joint name="joint{i}{SPRING}" type="hinge" axis="0 0 1" limited="false" springref="0"'
                f' stiffness="{stiffness!r}" damping="{DAMPING_S * stiffness!r}"/>'
            )
        if moving is not None:
            lines.append(_inertial_of(indent, moving.bodies[i - 1]))
        elif joint.mass_kg:
            lines.append(_inertial(indent, joint.mass_kg, _in_body(arm, i)))
    lines.append(f'{indent}<body name="flange"{_pose(arm.parts[-1])}>')
    if arm.rig.tool.mass_kg and moving is None:  # else part of the last link
        lines.append(_inertial(indent + "  ", arm.rig.tool.mass_kg, np.array(arm.rig.tool.com_m or (0.0, 0.0, 0.0))))
    if arm.tool_m is not None:
        lines.append(f'{indent}  <site name="tool_point" pos="{_numbers(arm.tool_m)}"/>')
    while len(indent) >= 4:
        lines.append(f"{indent}</body>")
        indent = indent[:-2]
    return "\n".join([*lines, "  </worldbody>", "</mujoco>", ""])


def _in_body(arm: IdentifiedArm, link: int) -> Floats:
    """(3,) centre of mass in the frame behind the turn of the joint, from the link frame of the rig's notation.

    Denavit and Hartenberg's stands at the end of the link, without the flange; all others' at its start, nominal.
    """
    own = arm.rig.arm
    com_m = np.array(own.joints[link - 1].com_m or (0.0, 0.0, 0.0))
    if own.model is not ArmModel.DH:
        to_body = transform((0.0, 0.0, 0.0), (0.0, 0.0, -arm.corrections.get(f"joint{link}.zero", 0.0)))
    else:
        kinematics = arm_of(arm.rig)
        to_body = kinematics.fixed_parts(values_by_name(kinematics.parameters, arm.corrections))[link]
        if link == arm.rig.n_joints:
            to_body = to_body @ inverse(transform(own.flange.origin_m, own.flange.rotation_rad))
    return np.asarray(to_body[:3, :3] @ com_m + to_body[:3, 3], dtype=np.float64)


def _inertial_of(indent: str, body: Body) -> str:
    tensor = _numbers(body.inertia_kg_m2.tolist())
    return f'{indent}<inertial pos="{_numbers(body.com_m.tolist())}" mass="{body.mass_kg!r}" fullinertia="{tensor}"/>'


def _inertial(indent: str, mass_kg: float, com_m: Floats) -> str:
    """A point mass, nearly: inertia moves no arm that stands."""
    small = 1e-4 * mass_kg
    return (
        f'{indent}<inertial pos="{_numbers(com_m.tolist())}" mass="{mass_kg!r}" '
        f'diaginertia="{_numbers((small, small, small))}"/>'
    )


def _pose(T: Floats) -> str:
    quaternion = Rotation.from_matrix(T[:3, :3]).as_quat(scalar_first=True)
    return f' pos="{_numbers(T[:3, 3].tolist())}" quat="{_numbers(quaternion.tolist())}"'


def _numbers(values: tuple[float, ...] | list[float]) -> str:
    return " ".join(repr(float(v)) for v in values)
