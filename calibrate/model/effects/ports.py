"""Ports: the places along the chain, from joint reading to instrument reading, where physics can enter.

A port states where in `Perturbation` a term acts and how many components it has there. Frames are those of
arms.serial.SerialArm: B_0 in front of joint 1, joint i turns about z of B_(i-1), B_n is the flange.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

JOINT = "joint"  # what a port of one joint's angle begins with; a late clock turns all joints at the flange alone


class Place(Enum):
    """What a port perturbs; the number of components is that of one sample."""

    JOINTS = "joints"  # (joint,) rad added to the readings
    FRAME = "frame"  # (6,) body twist [v; w] (m, rad) of B_i and all behind it
    SURROUNDINGS = "surroundings"  # (6,) base twist of all that is not the arm: fixture, device, seat
    READING = "reading"  # (k,) added to what one instrument reads, in its unit


@dataclass(frozen=True)
class Port:
    """`where` in the words of docs/formats.md; `index` is the frame of FRAME, `instrument` the one of READING.

    `past_encoders`, of JOINTS: behind both encoders of the joint, so that their difference does not show it.
    """

    where: str
    place: Place
    index: int = 0
    instrument: str = ""
    past_encoders: bool = False

    @property
    def between_encoders(self) -> bool:
        """Whether what acts here turns the joint between the controller's reading and the second encoder."""
        return self.place is Place.JOINTS and self.where.startswith(JOINT) and not self.past_encoders


@dataclass(frozen=True)
class Perturbation:
    """What all terms together do to every pose of a session. Sums of small twists: second-order terms are left out."""

    joints_rad: Floats  # (pose, joint)
    frames: Floats  # (pose, joint + 1, 6) body twists [v; w] of B_0 ... B_n
    surroundings: Floats  # (pose, 6) base twists
    readings: dict[str, Floats]  # instrument -> (pose, k); absent: none
    between_rad: Floats  # (pose, joint) of joints_rad, what the second encoders see

    @classmethod
    def none(cls, poses: int, joints: int) -> "Perturbation":
        return cls(
            np.zeros((poses, joints)),
            np.zeros((poses, joints + 1, 6)),
            np.zeros((poses, 6)),
            {},
            np.zeros((poses, joints)),
        )

    @classmethod
    def of_all(cls, poses: int, joints: int, added: Iterable[tuple[Port, Floats]]) -> "Perturbation":
        """Of amounts (pose, width of the port), each added at a port."""
        out = cls.none(poses, joints)
        for port, amount in added:
            out = out.plus(port, amount)
        return out

    def of(self, samples: Ints) -> "Perturbation":
        """Of some of the poses."""
        readings = {name: amount[samples] for name, amount in self.readings.items()}
        moved = self.joints_rad[samples], self.frames[samples], self.surroundings[samples]
        return Perturbation(*moved, readings, self.between_rad[samples])

    def plus(self, port: Port, amount: Floats) -> "Perturbation":
        """With `amount` (pose, width of the port) added at a port."""
        joints, frames, around = self.joints_rad, self.frames, self.surroundings
        readings, between = self.readings, self.between_rad
        match port.place:
            case Place.JOINTS:
                joints = joints + amount
                between = between + amount if port.between_encoders else between
            case Place.FRAME:
                frames = frames.copy()
                frames[:, port.index] += amount
            case Place.SURROUNDINGS:
                around = around + amount
            case Place.READING:
                readings = readings | {port.instrument: readings.get(port.instrument, 0.0) + amount}
        return Perturbation(joints, frames, around, readings, between)
