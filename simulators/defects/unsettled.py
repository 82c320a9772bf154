"""Samples taken before the arm stands: every joint still creeps towards its goal, which is what the controller reports.

First-order settling (a position loop without integrator): what is left of the move after `wait` is exp(-wait / T). The
field is that rest; it is the same for all joints and all moves, as the program waits the same time after each.
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
class Unsettled:
    """Arm that has `left` of every last move still to go (no unit)."""

    left: float
    joints: int

    KIND: ClassVar[str] = "unsettled"
    PHYSICS: ClassVar[str] = "not-settled"
    SIZE: ClassVar[str] = "left"
    TYPICAL: ClassVar[float] = 1e-5
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ROBOT
    HABIT: ClassVar[str] = "direct"

    @property
    def port(self) -> str:
        return "time"

    @property
    def drivers(self) -> tuple[str, ...]:
        return tuple(f"last_move{joint}" for joint in range(1, self.joints + 1))

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {"left_share": self.left}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(spread(rng, cls.TYPICAL), site.n_joints)

    def extra_turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        return -self.left * scene.last_move_rad
