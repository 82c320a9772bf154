"""A joint that gives way like a torsion spring under the weight beyond it.

Hooke: turn = torque / stiffness, in the pose that the deflected arm truly takes, with its true masses.
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
class SoftJoint:
    """Drive of one joint that turns `compliance_rad_nm` per newton metre."""

    joint: int
    compliance_rad_nm: float

    KIND: ClassVar[str] = "soft-joint"
    PHYSICS: ClassVar[str] = "joint-compliance"
    SIZE: ClassVar[str] = "compliance_rad_nm"
    TYPICAL: ClassVar[float] = 5e-6  # 1 to 10 urad/Nm: arms of 10 to 200 kg
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
        return {"compliance_rad_nm": self.compliance_rad_nm}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.loaded_joint(rng), spread(rng, cls.TYPICAL))

    def extra_turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        extra_rad = np.zeros_like(shaft_rad)
        column = self.joint - 1
        extra_rad[:, column] = self.compliance_rad_nm * load.torque_nm[:, column]
        return extra_rad
