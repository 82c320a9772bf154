"""The flange in the device's frame from the last two axis lines, as the nominal arm places it on them.

Source: patent CN114523474B, step 3: axis lines give the flange's origin and z. Here the frame on the lines is: origin
at the foot, on the last axis, of the common normal of both; z along the last axis; x across it in the direction of the
axis before. The arm's table gives the flange in that frame; lines alone do not determine the flange's face.
It is the start of the fit, which gives the flange with its uncertainty.
"""

import numpy as np
from numpy.typing import NDArray

from calibrate.arms.model import KinematicModel
from calibrate.errors import DataError
from calibrate.rigid import cross, inverse
from calibrate.tool_axes.circle import Circle

Floats = NDArray[np.float64]

PARALLEL = 0.17  # sine of 10 deg: nearer to parallel, the foot of the common normal runs away along the axis


def flange_frame(arm: KinematicModel, theta: Floats, before: Circle, last: Circle, q_rad: Floats) -> Floats:
    """(4, 4) T_device_flange at `q_rad` (joint,) from the circles of the last two joints, for an arm `theta` (param,).

    Both circles were taken at these readings of the joints before them. DataError for near-parallel axes.
    """
    lines = _frame(before.centre_m, before.normal, last.centre_m, last.normal)
    return lines @ _in_lines(arm, theta, q_rad)


def _in_lines(arm: KinematicModel, theta: Floats, q_rad: Floats) -> Floats:
    """(4, 4) T_line_flange of the arm."""
    q = q_rad[None]
    twists = arm.joint_twists(theta, q)[0]  # (6, joint): [v; w] of each axis, whose nearest point to the base is w x v
    lines = [(cross(w, v), w) for v, w in ((t[:3], t[3:]) for t in twists.T[-2:])]
    return inverse(_frame(*lines[0], *lines[1])) @ arm.flange(theta, q)[0]


def _frame(point_before: Floats, before: Floats, point_last: Floats, last: Floats) -> Floats:
    normal = cross(before, last)
    sine = float(np.linalg.norm(normal))
    if sine < PARALLEL:
        raise DataError(f"flange frame: the last two axes are {np.degrees(np.arcsin(sine)):.1f} deg from parallel")
    # foot on the last axis: point_last + t last, with (foot - point_before) square to (before x last) x before
    across = cross(normal, before)
    t = float((point_before - point_last) @ across / (last @ across))
    y = normal / -sine  # z x x with x the direction of `before` across z
    T = np.eye(4)
    T[:3, 0], T[:3, 1], T[:3, 2] = cross(y, last), y, last
    T[:3, 3] = point_last + t * last
    return T
