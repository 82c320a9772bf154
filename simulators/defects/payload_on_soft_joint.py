"""A joint whose controller takes its own weight into account but knows nothing of the payload.

The drive is a torsion spring; the feed-forward of the arm's own weight winds it back, so only the payload's torque is
left to turn the output.
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
class PayloadOnSoftJoint:
    """Drive of one joint that turns `compliance_rad_nm` per newton metre of the payload."""

    joint: int
    compliance_rad_nm: float

    KIND: ClassVar[str] = "payload-on-soft-joint"
    PHYSICS: ClassVar[str] = "payload-compliance"
    SIZE: ClassVar[str] = "compliance_rad_nm"
    TYPICAL: ClassVar[float] = 1e-5
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ROBOT
    HABIT: ClassVar[str] = "payload"

    @property
    def port(self) -> str:
        return f"joint{self.joint}.angle"

    @property
    def drivers(self) -> tuple[str, ...]:
        return ("payload",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ("payload_kg",)

    @property
    def figures(self) -> Mapping[str, float]:
        return {"compliance_rad_nm": self.compliance_rad_nm}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.loaded_joint(rng), spread(rng, cls.TYPICAL))

    def extra_turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        extra_rad = np.zeros_like(shaft_rad)
        extra_rad[:, self.joint - 1] = self.compliance_rad_nm * load.payload_torque_nm[:, self.joint - 1]
        return extra_rad
