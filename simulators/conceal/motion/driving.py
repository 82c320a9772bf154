"""Moves the world's arm, offline and without wires, and records it as a controller would: set-points, angles, torques.

Joints move as sums of sines, which excite all of them at many speeds (Swevers et al., "Optimal robot excitation and
identification", IEEE Trans. Robotics Autom. 13, 1997), within a share of their limits.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simulators.conceal.motion.motion_case import MotionCase
from simulators.world.model import STEP_S
from simulators.world.world import World

Floats = NDArray[np.float64]
RATE_HZ, LENGTH_S = 500.0, 20.0
BASE_HZ, WAVES = 0.1, 5
REACH, MOST_RAD = 0.3, 1.0  # of the way between the limits, and at most
SPEED_RAD_S = 1.5
BEGIN_S = 1.0  # in which the motion grows from standing


@dataclass(frozen=True, eq=False)
class Moved:
    """Rows are moments; (row, n) each, as recorded."""

    time_s: Floats  # (row,)
    target_rad: Floats
    q_rad: Floats
    torque_nm: Floats


def drive(case: MotionCase) -> Moved:
    """The whole motion, with the noise of the readings."""
    plan_rng, noise_rng = (np.random.default_rng([case.wanted.seed, stream]) for stream in (34, 35))
    time_s = np.arange(round(LENGTH_S * RATE_HZ)) / RATE_HZ
    target_rad = set_points(case, time_s, plan_rng)
    world = World.from_rig(case.true, seed=case.wanted.seed, q_rad=target_rad[0], hidden=case.hidden)
    q_rad, torque_nm = np.empty_like(target_rad), np.zeros_like(target_rad)
    for row, at_s in enumerate(time_s.tolist()):
        q_rad[row] = world.joints().q_rad
        world.command(target_rad[row])
        for step in (1, 2):  # means of cycles that end then: together those about the reading of the angles
            world.advance(at_s + step * STEP_S)
            torque_nm[row] += 0.5 * world.joints().torque_nm
    q_rad += case.angle_sigma_rad * noise_rng.standard_normal(q_rad.shape)
    torque_nm += case.torque_sigma_nm * noise_rng.standard_normal(torque_nm.shape)
    return Moved(time_s, target_rad, q_rad, torque_nm)


def set_points(case: MotionCase, time_s: Floats, rng: np.random.Generator) -> Floats:
    """(row, n); the first row stands."""
    joints = case.stated["arm"]["joint"]
    lower, upper = (np.array([joint[f"{end}_rad"] for joint in joints]) for end in ("lower", "upper"))
    n, way = len(joints), np.minimum(REACH * (upper - lower), MOST_RAD)
    turns = 2.0 * np.pi * BASE_HZ * np.arange(1, WAVES + 1)[:, None] * time_s  # (wave, row)
    size, phase = rng.normal(size=(n, WAVES)) / np.sqrt(np.arange(1, WAVES + 1)), rng.uniform(-np.pi, np.pi, (n, WAVES))
    sway = np.einsum("jw,jwr->rj", size, np.sin(turns + phase[..., None]))
    fastest = np.abs(np.gradient(sway, time_s, axis=0)).max(axis=0)
    sway *= np.minimum(way / np.abs(sway).max(axis=0), SPEED_RAD_S / fastest)
    begun = np.clip(time_s / BEGIN_S, 0.0, 1.0)[:, None]
    grown = begun**3 * (10.0 + begun * (6.0 * begun - 15.0))  # quintic: no jerk at its ends
    middle_rad = 0.5 * (lower + upper) + rng.uniform(-0.3, 0.3, n) * way
    return middle_rad + grown * sway
