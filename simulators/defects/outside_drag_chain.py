"""In no catalogue: a drag chain hits a stop when joint 1 turns far to one side, and leans on the pedestal."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.arm.rigid import turned
from simulators.defects.directions import ANY_INSTRUMENT, Vector, direction, spread
from simulators.defects.scene import Load, Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class DragChain:
    """Pedestal that leans by `lean_rad_rad` per radian of joint 1 beyond its middle."""

    lean_rad_rad: float
    about: Vector
    from_rad: float

    KIND: ClassVar[str] = "outside-drag-chain"
    PHYSICS: ClassVar[str] = "unknown"
    SIZE: ClassVar[str] = "lean_rad_rad"
    TYPICAL: ClassVar[float] = 5e-5
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ANY_INSTRUMENT
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return "base.pose"

    @property
    def drivers(self) -> tuple[str, ...]:
        return ("q1",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(spread(rng, cls.TYPICAL), direction(rng), 0.5 * sum(site.usual_rad[0]))

    def base_motion(self, scene: Scene, load: Load) -> Floats:
        beyond_rad = np.maximum(scene.goal_rad[:, 0] - self.from_rad, 0.0)
        return turned(self.lean_rad_rad * beyond_rad[:, np.newaxis] * np.asarray(self.about))
