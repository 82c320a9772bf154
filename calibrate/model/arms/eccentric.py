"""An arm whose encoder discs may sit off their shafts: two more parameters a joint, beside its zero.

angle_i = reading_i + zero_i + sine_i sin(reading_i) + cosine_i cos(reading_i). To first order in e / r, disc centre off
the shaft over radius of the graduation; what is left out is (e / r)^2, 1e-8 rad at 100 µrad. Source: Sanchez-Brea,
Morlanes, Metrological errors in optical encoders, Meas. Sci. Technol. 19, 2008. A measuring arm is calibrated with it
as with any length (docs/decisions/0020).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.model.chain import KinematicModel
from calibrate.model.parameters import Parameter

Floats = NDArray[np.float64]
SINE, COSINE = "disc_sine", "disc_cosine"


@dataclass(frozen=True)
class EccentricArm:
    """KinematicModel: the parameters of `arm`, then joint<i>.disc_sine and joint<i>.disc_cosine (rad)."""

    arm: KinematicModel
    sigma_rad: float  # prior of each about zero

    @property
    def n_joints(self) -> int:
        return self.arm.n_joints

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self._parameters

    @cached_property
    def _parameters(self) -> tuple[Parameter, ...]:
        discs = (f"joint{i + 1}.{part}" for i in range(self.n_joints) for part in (SINE, COSINE))
        return self.arm.parameters + tuple(Parameter(n, "rad", self.sigma_rad, prior=self.sigma_rad) for n in discs)

    def flange(self, theta: Floats, q_rad: Floats) -> Floats:
        return self.arm.flange(self._split(theta)[0], self.at_shafts(theta, q_rad))

    def at_shafts(self, theta: Floats, q_rad: Floats) -> Floats:
        """(pose, joint) readings less the errors of the discs: what `arm` is to be given."""
        _, sine, cosine = self._split(theta)
        return q_rad + sine * np.sin(q_rad) + cosine * np.cos(q_rad)

    def twists(self, theta: Floats, q_rad: Floats) -> Floats:
        own, sine, cosine = self._split(theta)
        s, c = np.sin(q_rad), np.cos(q_rad)
        angle_rad = q_rad + sine * s + cosine * c
        by_joint = self.arm.joint_twists(own, angle_rad)
        discs = by_joint[..., np.newaxis] * np.stack([s, c], axis=-1)[:, np.newaxis]
        by_disc = discs.reshape(len(q_rad), 6, 2 * self.n_joints)
        return np.concatenate([self.arm.twists(own, angle_rad), by_disc], axis=-1)

    def joint_twists(self, theta: Floats, q_rad: Floats) -> Floats:
        own, sine, cosine = self._split(theta)
        s, c = np.sin(q_rad), np.cos(q_rad)
        by_angle = self.arm.joint_twists(own, q_rad + sine * s + cosine * c)
        return by_angle * (1.0 + sine * c - cosine * s)[:, np.newaxis]

    def _split(self, theta: Floats) -> tuple[Floats, Floats, Floats]:
        n = len(self.arm.parameters)
        discs = theta[n:].reshape(-1, 2)
        return theta[:n], discs[:, 0], discs[:, 1]


def with_discs(arm: KinematicModel, rig: Rig) -> KinematicModel:
    """The arm with its discs where the rig's [tolerance] leaves them open, else as it is."""
    if rig.tolerance is None or rig.tolerance.eccentricity_rad is None:
        return arm
    return EccentricArm(arm, rig.tolerance.eccentricity_rad)
