"""Arms whose errors are drawn, measured by a tracker while the wrist turns: plain 4x4 products of their own."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import Arm, ArmModel, Joint, Rig
from calibrate.model.arms.catalogue import arm_of
from calibrate.tool_axes.arm_prior import ArmErrors, assumed_prior
from calibrate.tool_axes.tool import calibrate_tool
from calibrate.tool_axes.wrist_fit import TargetRows

QUARTER = np.pi / 2
# theta offset (rad), a (m), d (m), alpha (rad)
UR5 = np.array(
    [
        (0, 0, 0.089159, QUARTER),
        (0, -0.425, 0, 0),
        (0, -0.39225, 0, 0),
        (0, 0, 0.10915, QUARTER),
        (0, 0, 0.09465, -QUARTER),
        (0, 0, 0.0823, 0),
    ]
)
OBLIQUE = np.array(  # a hollow wrist: its axes cross at 60 deg, the last two do not meet
    [
        (0, 0.15, 0.45, -QUARTER),
        (-QUARTER, 0.6, 0, 0),
        (0, 0.12, 0, -QUARTER),
        (0, 0, 0.64, np.pi / 3),
        (0, 0.04, 0.06, -np.pi / 3),
        (np.pi, 0, 0.1, 0),
    ]
)
HOME = np.array([0.3, -1.2, 1.4, -0.4, 1.2, 0.5])
TOOL = np.array([0.035, -0.02, 0.11])
NOISE_M = 2e-5


@dataclass
class Drawn:
    """What an arm truly is: its table with errors and Hayati's tilts."""

    table: np.ndarray
    tilt: np.ndarray

    def flange(self, q):
        """(pose, 4, 4)."""
        T = np.tile(np.eye(4), (len(q), 1, 1))
        for (offset, a, d, alpha), tilt, angle in zip(self.table, self.tilt, q.T, strict=True):
            turn = np.tile(np.eye(4), (len(q), 1, 1))
            turn[:, :3, :3] = Rotation.from_rotvec((angle + offset)[:, None] * [0, 0, 1]).as_matrix()
            tail = np.eye(4)
            tail[:3, :3] = Rotation.from_euler("XY", [alpha, tilt]).as_matrix()
            tail[:3, 3] = a, 0, d
            T = T @ turn @ tail
        return T


def draw(table, errors, rng):
    """Zeros, lengths, angles by the stated sigmas; a tilt only where the next axis is near parallel."""
    off = np.column_stack(
        [
            rng.normal(0, errors.zero_sigma_rad, 6),
            rng.normal(0, errors.length_sigma_m, (6, 2)),
            rng.normal(0, errors.angle_sigma_rad, 6),
        ]
    )
    tilt = rng.normal(0, errors.angle_sigma_rad, 6) * (np.abs(np.cos(table[:, 3])) > 0.9)
    return Drawn(table + off, tilt)


def nominal(table, links):
    joints = tuple(Joint(-7, 7, a_m=a, alpha_rad=w, d_m=d, theta_offset_rad=t) for t, a, d, w in table.tolist())
    return arm_of(Rig(1, "drawn", Arm(ArmModel.DH, joints)), links)


def turns(*joints, steps=12, span=1.5, home=HOME):
    """Readings in which each joint alone turns to and fro about home."""
    return np.array(
        [home + angle * (np.arange(6) == j - 1) for j in joints for angle in np.linspace(-span, span, steps)]
    )


def measured(truth, q, rng, target=TOOL, noise_m=NOISE_M):
    """Positions in the frame of a tracker that stands anywhere."""
    T = truth.flange(q)
    place = np.random.default_rng(5)
    turn, shift = Rotation.random(random_state=5), place.normal(0, 2, 3)
    points = T[:, :3, :3] @ target + T[:, :3, 3]
    return turn.apply(points) + shift + rng.normal(0, noise_m, points.shape)


def found_on(table, errors, joints, seed, assumed=None):
    """Tool of one drawn arm, calibrated with the assumed errors (those it was drawn by, if none are given)."""
    rng = np.random.default_rng(seed)
    assumed = errors if assumed is None else assumed
    arm, q = nominal(table, assumed.links), turns(*joints)
    rows = TargetRows(q, measured(draw(table, errors, rng), q, rng))
    return calibrate_tool(arm, (rows,), assumed_prior(arm, assumed.zero_sigma_rad))


def whitened_errors(table, errors, joints, seeds, assumed=None):
    """(arm, 3) error over sigma of the target, of all arms that got a number."""
    found = [found_on(table, errors, joints, seed, assumed).targets[0] for seed in seeds]
    return np.array([(t.point_m - TOOL) / t.sigma_m for t in found if t.point_m is not None])


ZEROS_ONLY = ArmErrors(zero_sigma_rad=3e-3, length_sigma_m=0.0, angle_sigma_rad=0.0)
ZEROS_AND_LENGTHS = ArmErrors(zero_sigma_rad=3e-3, length_sigma_m=3e-4, angle_sigma_rad=0.0)
