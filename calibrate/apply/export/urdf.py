"""URDF of an identified arm: fixed base, turning joints, a fixed flange and, where known, the tool point.

Source of the form: ROS wiki, urdf/XML/joint: origin first (xyz in m, rpy in rad about fixed axes), then the turn about
`axis`. `effort` is obligatory there and no matter of calibration: 0 means nothing.
"""

from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from calibrate.apply.export.identified import IdentifiedArm, roll_pitch_yaw

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
