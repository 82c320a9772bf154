"""A probe in a cone: its point is fixed, the operator chooses the posture, the encoders say the joint angles."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import forward, jacobian, reach_point, within_limits
from simulators.conceal.chain import balanced, said_rad
from simulators.conceal.readings import tip_m
from simulators.conceal.rig import Artefacts, TrueRig
from simulators.defects import Defect, Scene
from simulators.defects.defect import MovesSeat

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]
STEPS = 6  # the defects move the probe by 1e-4 m at most; the steps converge by a factor of 1e-3 each
DRAW_ROUNDS = 20


def seated_readings(
    rig: TrueRig, artefacts: Artefacts, scene: Scene, defects: Sequence[Defect], posture_rad: Floats
) -> Floats:
    """Encoder readings (row, n) with the probe truly in its cone, in the posture nearest to `posture_rad` (row, n)."""
    return readings_at(rig, artefacts.seat_m[scene.seat - 1], scene, defects, posture_rad)


def readings_at(rig: TrueRig, wanted_m: Floats, scene: Scene, defects: Sequence[Defect], posture_rad: Floats) -> Floats:
    """The same with cones at `wanted_m` (row, 3) in the base, before anything moves them."""
    for defect in defects:
        if isinstance(defect, MovesSeat):
            wanted_m = wanted_m + defect.seat_shift_m(scene)
    shaft_rad = posture_rad.copy()
    for _ in range(STEPS):
        stance = balanced(rig.arm, scene, defects, shaft_rad)
        here_m = tip_m(rig, stance)
        slope = jacobian(stance.frames, here_m)[:, :3]
        square = slope @ slope.swapaxes(-1, -2)
        shaft_rad = shaft_rad + np.einsum(
            "rij,ri->rj", slope, np.linalg.solve(square, (wanted_m - here_m)[..., np.newaxis])[..., 0]
        )
    return said_rad(defects, scene, shaft_rad)


def seated_tip_m(rig: TrueRig, reading_rad: Floats) -> Floats:
    """Where an arm without defects has its probe at these readings, (row, 3)."""
    flange = forward(rig.arm, reading_rad + rig.arm.zero_rad).flange
    return flange[:, :3, :3] @ rig.tool_point_m + flange[:, :3, 3]


def seated_plan(
    rig: TrueRig, artefacts: Artefacts, poses: int, rng: np.random.Generator
) -> tuple[Floats, Whole, Whole]:
    """Postures (row, n), their seats (row,), and `linked` (row,): rows of one number stay together, in this order.

    Every holding of a bar is probed once at each end; the rest of the poses goes to the cones. 0: not linked. A holding
    of which one end cannot be reached is left out, and so are holdings beyond a third of the poses.
    """
    holdings = min(len(artefacts.held), poses // 6)
    ends = artefacts.cones + 1 + np.arange(2 * holdings)
    at_cones = rng.integers(1, artefacts.cones + 1, max(poses - ends.size, 0))
    seat = np.concatenate((at_cones, ends))
    linked = np.concatenate((np.zeros_like(at_cones), np.repeat(np.arange(1, holdings + 1), 2)))
    reading_rad = postures(rig, artefacts.seat_m, seat, rng)
    found = np.isfinite(reading_rad).all(axis=1)
    lost = np.unique(linked[~found])
    found &= (linked == 0) | ~np.isin(linked, lost)
    return reading_rad[found], seat[found], linked[found]


def shaken_rad(rig: TrueRig, reading_rad: Floats, contact_m: Floats) -> Floats:
    """Scatter of the probe in its cone: the smallest joint angles (row, n) that move it by `contact_m` (row, 3)."""
    frames = forward(rig.arm, reading_rad + rig.arm.zero_rad)
    slope = jacobian(frames, seated_tip_m(rig, reading_rad))[:, :3]
    square = slope @ slope.swapaxes(-1, -2)
    return np.einsum("rij,ri->rj", slope, np.linalg.solve(square, contact_m[..., np.newaxis])[..., 0])


def postures(rig: TrueRig, seat_m: Floats, seat: Whole, rng: np.random.Generator) -> Floats:
    """A random posture (row, n) for each seat (row,) from 1, with the probe in it and within the limits."""
    arm = rig.arm
    reading_rad = np.full((seat.size, arm.n_joints), np.nan)
    missing = np.arange(seat.size)
    for _ in range(DRAW_ROUNDS):
        start_rad = rng.uniform(arm.lower_rad, arm.upper_rad, (missing.size, arm.n_joints)) + arm.zero_rad
        joint_rad, arrived = reach_point(arm, rig.tool_point_m, seat_m[seat[missing] - 1], start_rad)
        said, inside = within_limits(arm, joint_rad)
        good = arrived & inside
        reading_rad[missing[good]] = said[good]
        missing = missing[~good]
        if not missing.size:
            break
    return reading_rad
