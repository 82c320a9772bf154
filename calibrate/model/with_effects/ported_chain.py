"""The chain with its ports: frames of the arm under a perturbation, and what any port does to any reading.

Whatever acts at a joint, a link or around the arm moves the flange by a base twist, so one derivative of a reading by
that twist and the adjoints of the frames give the sensitivity of all ports at once.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from calibrate.model.arms.serial import SerialArm, chain_frames
from calibrate.model.chain import ObservationModel
from calibrate.model.effects.ports import Perturbation, Place, Port
from calibrate.model.problem import Measured
from calibrate.model.rigid import cross_matrix, inverse, turn_twist

Floats = NDArray[np.float64]


def perturbed_frames(arm: SerialArm, theta: Floats, q_rad: Floats, by: Perturbation) -> Floats:
    """(pose, joint + 1, 4, 4) B_0 ... B_n as the surroundings see them, for readings (pose, joint)."""
    fixed = arm.fixed_parts(theta)
    angle_rad = arm.angles_rad(theta, q_rad, by.joints_rad)
    perturbed = {i: offsets(by.frames[:, i]) for i in range(arm.n_joints + 1) if np.any(by.frames[:, i])}
    return chain_frames(inverse(offsets(by.surroundings)) @ fixed[0], fixed[1:], angle_rad, perturbed)


def offsets(twists: Floats) -> Floats:
    """(pose, 4, 4) shift and rotation vector of small twists (pose, 6)."""
    out = np.broadcast_to(np.eye(4), (len(twists), 4, 4)).copy()
    out[:, :3, :3] = Rotation.from_rotvec(twists[:, 3:]).as_matrix()
    out[:, :3, 3] = twists[:, :3]
    return out


def flange_twists(frames: Floats, port: Port, basis: Floats) -> Floats:
    """(pose, 6, m) base twist of the flange by each coefficient, from what it adds at a port (pose, width, m).

    ValueError for the port of a reading, which moves nothing.
    """
    match port.place:
        case Place.JOINTS:
            return joint_turns(frames) @ basis
        case Place.FRAME:
            return adjoints(frames[:, port.index]) @ basis
        case Place.SURROUNDINGS:
            return -basis
        case Place.READING:
            raise ValueError(f"port {port.where} moves no frame")


def adjoints(T_base_frame: Floats) -> Floats:
    """(pose, 6, 6) that turn body twists [v; w] of proper frames (pose, 4, 4) into base twists."""
    R = T_base_frame[:, :3, :3]
    out = np.zeros((len(R), 6, 6))
    out[:, :3, :3] = out[:, 3:, 3:] = R
    out[:, :3, 3:] = cross_matrix(T_base_frame[:, :3, 3]) @ R
    return out


@dataclass(frozen=True, eq=False)
class Look:
    """What one instrument is expected to read, and how its readings follow the flange of each pose of a row.

    Reading terms come on top. Each part is computed when it is asked for: a trial step of a solver wants no derivative.
    """

    chain: ObservationModel
    own: Floats  # (sensor parameter,)
    flanges: tuple[Floats, ...]  # of each pose of the row (row, 4, 4)

    @cached_property
    def expected(self) -> Floats:
        """(row, k)"""
        return self.chain.at_flanges(self.own, self.flanges)

    @cached_property
    def by_twists(self) -> tuple[Floats, ...]:
        """Of each pose of the row (row, k, 6)."""
        return self.chain.by_flanges(self.own, self.flanges)

    @cached_property
    def by_sensor(self) -> Floats:
        """(row, k, own parameters of the sensor)"""
        return self.chain.by_own(self.own, self.flanges)


def look(measured: Measured, own: Floats, frames: Floats) -> Look:
    """One instrument at frames (sample, joint + 1, 4, 4); `own` (param,) of its chain."""
    chain = measured.problem.chain
    return Look(chain, own[len(chain.model.parameters) :], tuple(frames[rows, -1] for rows in measured.sample_rows.T))


def through(seen: Look, measured: Measured, twists: Floats) -> Floats:
    """(row, k, m) change of the readings by flange twists (sample, 6, m)."""
    each = zip(seen.by_twists, measured.sample_rows.T, strict=True)
    return sum((by @ twists[rows] for by, rows in each), np.zeros((*seen.expected.shape, twists.shape[-1])))


def joint_turns(frames: Floats) -> Floats:
    """(pose, 6, joint) base twist of the flange by the turn of each joint."""
    before = frames[:, :-1]
    return np.swapaxes(turn_twist(before[..., :3, 2], before[..., :3, 3]), 1, 2)
