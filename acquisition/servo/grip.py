"""How well the joints can still steer the beam's line, and the roll about the beam that brings a lost grip back.

Near a singular posture of the wrist a step towards the centres turns joints far and hardly moves the spots, and leads
deeper into it. Spots fix the line only: the arm may roll about it. Rolled towards the better grip, joint speeds along
the gradient within the null space, it can steer again. Source: A. Liegeois, IEEE Trans. SMC 7 (1977) 868, gradient
projection; T. Yoshikawa, Int. J. Robotics Research 4 (1985) 3, the measure.
"""

import numpy as np
from numpy.typing import NDArray

from acquisition.believed import BelievedArm

Floats = NDArray[np.float64]

# Least singular value, rad a rad: of 700 random postures 1 in 100 has less. Of 700 runs the one that lost the light for
# good had been to 0.05, the next worst (14 motions) to 0.09.
LEAST_GRIP = 0.2
LEVER_M = 0.1  # makes offsets of the line and its tilts comparable: about the distance between the two faces
ROLLED_RAD = 0.2  # largest joint step of one roll: zeros off by 2 deg then shift the spots by up to 3 mm
INNER_RAD = 0.02
DIFFERENCE_RAD = 1e-4


def grip(arm: BelievedArm, q_rad: Floats, stand_off_m: float) -> float:
    """Least singular value of d(line)/dq: offset (by LEVER_M) and tilt of the beam where it meets the first face."""
    return float(np.linalg.svd(_line_jacobian(arm, q_rad, stand_off_m), compute_uv=False)[-1])


def rolled(arm: BelievedArm, q_rad: Floats, stand_off_m: float) -> Floats:
    """A joint step (joint,) that rolls about the believed beam towards the better grip, until that is twice enough."""
    begin_rad, (origin_m, direction) = q_rad, arm.beam(q_rad)
    while grip(arm, q_rad, stand_off_m) < 2.0 * LEAST_GRIP:
        held = _held(arm, q_rad, stand_off_m)
        back = np.linalg.pinv(held)
        uphill = _gradient(arm, q_rad, stand_off_m)
        uphill = uphill - back @ (held @ uphill)
        largest = float(np.max(np.abs(uphill)))
        if largest < DIFFERENCE_RAD:  # the best there is
            break
        now_m, along = arm.beam(q_rad)
        across = _across(along)
        shift_m = origin_m - now_m
        off = np.concatenate(
            [
                across @ (shift_m + stand_off_m * (direction - along)) / LEVER_M,
                across @ (direction - along),
                [along @ shift_m / LEVER_M],
            ]
        )
        stepped = q_rad + INNER_RAD / largest * uphill + back @ off
        if float(np.max(np.abs(stepped - begin_rad))) > ROLLED_RAD:
            break
        if np.any(stepped < arm.lower_rad) or np.any(stepped > arm.upper_rad):
            break
        if grip(arm, stepped, stand_off_m) <= grip(arm, q_rad, stand_off_m):
            break
        q_rad = stepped
    return q_rad - begin_rad


def _line_jacobian(arm: BelievedArm, q_rad: Floats, stand_off_m: float) -> Floats:
    """(4, joint)."""
    across, J = _across(arm.beam(q_rad)[1]), arm.beam_jacobian(q_rad)
    return np.vstack([across @ (J[:3] + stand_off_m * J[3:]) / LEVER_M, across @ J[3:]])


def _held(arm: BelievedArm, q_rad: Floats, stand_off_m: float) -> Floats:
    """(5, joint): the line, and the laser's place along it; the roll alone is free."""
    along = arm.beam(q_rad)[1] @ arm.beam_jacobian(q_rad)[:3] / LEVER_M
    return np.vstack([_line_jacobian(arm, q_rad, stand_off_m), along])


def _gradient(arm: BelievedArm, q_rad: Floats, stand_off_m: float) -> Floats:
    here = grip(arm, q_rad, stand_off_m)
    steps = DIFFERENCE_RAD * np.eye(q_rad.size)
    return np.array([grip(arm, q_rad + step, stand_off_m) - here for step in steps]) / DIFFERENCE_RAD


def _across(direction: Floats) -> Floats:
    """(2, 3): axes square to a direction."""
    return np.asarray(np.linalg.svd(direction[None])[2][1:], dtype=np.float64)
