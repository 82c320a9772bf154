"""A strain-wave gear: soft while the flexspline's teeth find their seat, stiffer beyond.

Harmonic Drive, "Engineering data", torsional stiffness: K1 up to the torque T1, K2 = K1 / `hardening` beyond;
deflection is T / K1 below and T1 / K1 + (T - T1) / K2 above, the same for both senses.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.directions import ROBOT, spread
from simulators.defects.scene import Load, Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class TwoSlopeFlexspline:
    """Drive of one joint that turns `compliance_rad_nm` per newton metre up to `knee_nm`."""

    joint: int
    compliance_rad_nm: float
    hardening: float
    knee_nm: float

    KIND: ClassVar[str] = "two-slope-flexspline"
    PHYSICS: ClassVar[str] = "joint-compliance"
    SIZE: ClassVar[str] = "compliance_rad_nm"
    TYPICAL: ClassVar[float] = 6e-6
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ROBOT
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return f"joint{self.joint}.angle"

    @property
    def drivers(self) -> tuple[str, ...]:
        return (f"gravity_torque{self.joint}",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {"compliance_rad_nm": self.compliance_rad_nm, "knee_nm": self.knee_nm}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        joint = site.loaded_joint(rng)
        knee_nm = float(rng.uniform(0.3, 0.7) * site.torque_nm[joint - 1])
        return cls(joint, spread(rng, cls.TYPICAL), float(rng.uniform(0.3, 0.7)), knee_nm)

    def extra_turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        extra_rad = np.zeros_like(shaft_rad)
        torque_nm = load.torque_nm[:, self.joint - 1]
        soft_nm = np.clip(torque_nm, -self.knee_nm, self.knee_nm)
        extra_rad[:, self.joint - 1] = self.compliance_rad_nm * (soft_nm + self.hardening * (torque_nm - soft_nm))
        return extra_rad
