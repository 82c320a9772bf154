"""Slack in a drive where weight decides the flank: the output lies on the lower flank, by half the play.

Near balance friction of the output (`friction_nm`) holds it between the flanks: the offset goes over from one flank to
the other in proportion to the torque, min(max(torque / friction, -1), 1).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.directions import ROBOT, spread
from simulators.defects.scene import Load, Scene
from simulators.defects.site import Site, UnsuitedError

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SlackUnderWeight:
    """Drive of one joint with `play_rad` between its flanks, too smooth to hold its load."""

    joint: int
    play_rad: float
    friction_nm: float

    KIND: ClassVar[str] = "slack-under-weight"
    PHYSICS: ClassVar[str] = "backlash"
    SIZE: ClassVar[str] = "play_rad"
    TYPICAL: ClassVar[float] = 2e-4
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
        return {"play_rad": self.play_rad}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        if not site.gear_ratio:
            raise UnsuitedError("the arm has no gears")
        return cls(site.loaded_joint(rng), spread(rng, cls.TYPICAL), float(rng.uniform(0.1, 0.5)))

    def extra_turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        extra_rad = np.zeros_like(shaft_rad)
        column = self.joint - 1
        lean = np.clip(load.torque_nm[:, column] / self.friction_nm, -1.0, 1.0)
        extra_rad[:, column] = 0.5 * self.play_rad * lean
        return extra_rad
