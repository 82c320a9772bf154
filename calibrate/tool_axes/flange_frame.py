"""The flange in the device's frame from the last two axis lines, as the arm's drawing hangs it on them.

Source: patent CN114523474B, step 3: axis lines give the flange's origin and z. Here the frame on the lines is: origin
at the foot, on the last axis, of the common normal of both; z along the last axis; x across it in the direction of the
axis before. The drawing says where the flange is in that frame; lines alone cannot know the flange's face.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.arms.model import KinematicModel
from calibrate.errors import DataError
from calibrate.parameters import start_values
from calibrate.rigid import cross, inverse
from calibrate.tool_axes.circle import Circle

Floats = NDArray[np.float64]

PARALLEL = 0.17  # sine of 10 deg: nearer to parallel, the foot of the common normal runs away along the axis
STEP = 1e-6  # m, rad: of the differences that carry the doubt over; the frame is smooth on the scale of the arm


@dataclass(frozen=True)
class FlangeFrame:
    """Where the flange is at the readings `q_rad`, seen by the device."""

    T_device_flange: Floats  # (4, 4)
    q_rad: Floats  # (joint,)
    origin_sigma_m: Floats  # (3,) along the device's axes; of the measurement: the drawing's own doubt is not in it
    z_sigma_rad: float


def flange_frame(arm: KinematicModel, before: Circle, last: Circle, q_rad: Floats) -> FlangeFrame:
    """From the circles of the last two joints (same readings of the others). DataError for near-parallel axes."""
    T_line_flange = _drawn(arm, q_rad)
    T = _on_lines(before, last) @ T_line_flange
    columns: list[Floats] = []
    for k in range(12):
        ends: list[Floats] = []
        for sign in (1.0, -1.0):
            change = np.zeros(12)
            change[k] = sign * STEP
            moved = _on_lines(before.moved(change[:6]), last.moved(change[6:])) @ T_line_flange
            ends.append(moved[:3, 3])
        columns.append((ends[0] - ends[1]) / (2.0 * STEP))
    by = np.stack(columns, axis=1)  # (3, 12)
    covariance = by[:, :6] @ before.covariance @ by[:, :6].T + by[:, 6:] @ last.covariance @ by[:, 6:].T
    return FlangeFrame(T, q_rad, np.sqrt(np.diag(covariance)), last.normal_sigma_rad)


def _drawn(arm: KinematicModel, q_rad: Floats) -> Floats:
    """(4, 4) T_line_flange of the arm as drawn."""
    theta, q = start_values(arm.parameters), q_rad[None]
    twists = arm.joint_twists(theta, q)[0]  # (6, joint): [v; w] of each axis, whose nearest point to the base is w x v
    lines = [(cross(w, v), w) for v, w in ((t[:3], t[3:]) for t in twists.T[-2:])]
    return inverse(_frame(*lines[0], *lines[1])) @ arm.flange(theta, q)[0]


def _on_lines(before: Circle, last: Circle) -> Floats:
    return _frame(before.centre_m, before.normal, last.centre_m, last.normal)


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
