"""Slack in a drive: the output trails the motor by half the play, on the side it came from.

The play operator with the whole history of the motion (see `play`): a move shorter than the play leaves the output
where it was. Friction holds the output against gravity.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.directions import ROBOT, spread
from simulators.defects.play import played
from simulators.defects.scene import Load, Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SlackDrive:
    """Drive of one joint with `play_rad` between its flanks."""

    joint: int
    play_rad: float

    KIND: ClassVar[str] = "slack-drive"
    PHYSICS: ClassVar[str] = "backlash"
    SIZE: ClassVar[str] = "play_rad"
    TYPICAL: ClassVar[float] = 1e-4
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ROBOT
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return f"joint{self.joint}.angle"

    @property
    def drivers(self) -> tuple[str, ...]:
        return (f"approach{self.joint}",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ("approach",)

    @property
    def figures(self) -> Mapping[str, float]:
        return {"play_rad": self.play_rad}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.geared_joint(rng), spread(rng, cls.TYPICAL))

    def extra_turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        extra_rad = np.zeros_like(shaft_rad)
        column = self.joint - 1
        extra_rad[:, column] = played(scene.via_rad[:, column], scene.goal_rad[:, column], self.play_rad)
        return extra_rad
