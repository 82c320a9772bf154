"""A foot on a spring: the arm's braking sets it swinging, and it swings on after the stop.

x'' + 2 z w x' + w^2 x = -a (a mass on a spring that is shaken; any text on vibration).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.defect import Vector, direction
from simulators.streams.course import STEP_S, Course, swung

Floats = NDArray[np.float64]
SETTLED_S = 0.06  # after a stop, from which its size counts


@dataclass(frozen=True)
class SwingingFoot:
    """Foot that swings by `turn_rad` rms just after the stops."""

    frequency_hz: float
    damping: float
    turn_rad: float
    about: Vector

    KIND: ClassVar[str] = "stream-swinging-foot"
    PHYSICS: ClassVar[str] = "ringing"

    @property
    def port(self) -> str:
        return "base.pose"

    @property
    def drivers(self) -> tuple[str, ...]:
        return ("t",)

    @property
    def figures(self) -> Mapping[str, float]:
        return {"frequency_hz": self.frequency_hz, "damping_share": self.damping}

    @property
    def size(self) -> float:
        return self.turn_rad * 0.5 / 2e-6

    @classmethod
    def draw(cls, rng: np.random.Generator, n_joints: int) -> Self:
        return cls(
            float(rng.uniform(6.0, 16.0)),
            float(rng.uniform(0.02, 0.06)),
            float(np.exp(rng.uniform(np.log(1.5e-5), np.log(1e-4)))),
            direction(rng),
        )

    def sway_rad(self, course: Course) -> Floats:
        shaken = np.gradient(np.gradient(course.q_rad[:, :3].sum(axis=1), STEP_S), STEP_S)
        swing = swung(shaken[:, np.newaxis], self.frequency_hz, self.damping)[:, 0]
        after = np.interp(course.stops_s[1:] + SETTLED_S, course.time_s, swing)
        scale = self.turn_rad / max(float(np.sqrt(np.mean(after**2))), 1e-300)
        return scale * swing[:, np.newaxis] * np.asarray(self.about)
