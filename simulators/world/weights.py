"""The true arm of a world in numbers: fixed parts between its axes, zeros, and masses where its links truly are."""

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import Arm
from simulators.arm.rigid import moved, shifted, turned
from simulators.world.rig import WorldRig
from simulators.world.truth import TrueLink, Truth

Floats = NDArray[np.float64]
NO_LIMIT_RAD = 2.0 * np.pi


def arm_of(rig: WorldRig, truth: Truth) -> Arm:
    """T_base_flange(q) = F0 Rz(q1) F1 Rz(q2) ... Fn, of the links that were drawn. Limits: a full turn both ways."""
    n = len(truth.links)
    ends = [_end(link) for link in truth.links]
    offsets = [turned((0.0, 0.0, link.theta_offset_rad)) for link in truth.links]
    flange = moved(truth.flange.origin_m, truth.flange.rotation_rad)
    between = [end @ offset for end, offset in zip(ends[:-1], offsets[1:], strict=True)]
    com_m = [end[:3, :3] @ joint.com_m + end[:3, 3] for end, joint in zip(ends, rig.arm.joint, strict=True)]
    return Arm(
        fixed=np.stack([offsets[0], *between, ends[-1] @ flange]),
        zero_rad=np.array(truth.joint_zero_rad),
        lower_rad=np.full(n, -NO_LIMIT_RAD),
        upper_rad=np.full(n, NO_LIMIT_RAD),
        mass_kg=np.array([joint.mass_kg for joint in rig.arm.joint]),
        com_m=np.array(com_m),
        tool_kg=rig.tool.mass_kg,
        tool_com_m=np.array(rig.tool.com_m),
        gravity_m_s2=np.array(rig.arm.gravity_m_s2),
    )


def _end(link: TrueLink) -> Floats:
    """Tz(d) Tx(a) Rx(alpha) Ry(beta)."""
    return shifted((link.a_m, 0.0, link.d_m)) @ turned((link.alpha_rad, 0.0, 0.0)) @ turned((0.0, link.beta_rad, 0.0))
