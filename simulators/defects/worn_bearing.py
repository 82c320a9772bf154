"""A worn bearing: the axis of a joint leans while it turns, in a pattern that goes round with the rolling elements.

Seen from the housing the axis leans towards (cos(k q + b), sin(k q + b)): races with 2 or 3 lobes give k = +-2, +-3,
a bent race in the housing against a bent shaft k = -1 (Bryan, Clouser and Holland, "Spindle accuracy", American
Machinist 1967: error motions). k = +1 would turn with the joint, and is geometry.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.arm.rigid import turned
from simulators.defects.directions import ANY_INSTRUMENT, phase, spread
from simulators.defects.scene import Load, Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class WornBearing:
    """Joint whose axis leans by `lean_rad`; `cycles` per turn, positive in the joint's own sense."""

    joint: int
    lean_rad: float
    cycles: int
    bearing_rad: float

    KIND: ClassVar[str] = "worn-bearing"
    PHYSICS: ClassVar[str] = "axis-wobble"
    SIZE: ClassVar[str] = "lean_rad"
    TYPICAL: ClassVar[float] = 3e-5
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ANY_INSTRUMENT
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return f"link{self.joint}.tilt"

    @property
    def drivers(self) -> tuple[str, ...]:
        return (f"q{self.joint}",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {
            "amplitude_rad": abs(self.lean_rad),
            "order": float(abs(self.cycles)),
            "sense": float(np.sign(self.cycles)),
        }

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        joint = site.any_joint(rng)
        return cls(joint, spread(rng, cls.TYPICAL), int(rng.choice([-3, -2, -1, 2, 3])), phase(rng))

    @property
    def links(self) -> tuple[int, ...]:
        return (self.joint,)

    def link_motion(self, link: int, end_m: Floats, angle_rad: Floats, scene: Scene, load: Load) -> Floats:
        turn_rad = angle_rad[:, self.joint - 1]
        towards_rad = (self.cycles - 1) * turn_rad + self.bearing_rad  # seen from the frame that turns with the joint
        lean = np.stack((np.cos(towards_rad), np.sin(towards_rad), np.zeros_like(towards_rad)), axis=1)
        return turned(self.lean_rad * lean)
