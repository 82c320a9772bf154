"""A mount at the flange that gives way: what it holds leans towards where gravity pulls it.

Cantilever with its mass on the axis of the flange: the lean is across axis and gravity, in proportion to the part of
gravity across the axis, about the foot of the mount.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.arm.rigid import turned
from simulators.defects.directions import ROBOT, Vector, as_vector, spread
from simulators.defects.scene import Load, Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SaggingMount:
    """Mount that leans by `lean_rad` when its axis is level."""

    lean_rad: float
    axis: Vector
    at_laser: bool

    KIND: ClassVar[str] = "sagging-mount"
    PHYSICS: ClassVar[str] = "tool-sag"
    SIZE: ClassVar[str] = "lean_rad"
    TYPICAL: ClassVar[float] = 6e-5
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ROBOT
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return "laser.direction" if self.at_laser else "tool.point"

    @property
    def drivers(self) -> tuple[str, ...]:
        return ("gravity_tool",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {"lean_rad": self.lean_rad}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        axis = np.array([0.0, 0.0, 1.0]) + 0.2 * rng.standard_normal(3)
        return cls(spread(rng, cls.TYPICAL), as_vector(axis / np.linalg.norm(axis)), site.instrument == "dual-psd")

    def tool_motion(self, scene: Scene, load: Load) -> Floats:
        return turned(self.lean_rad * np.cross(np.asarray(self.axis), load.down_flange))
