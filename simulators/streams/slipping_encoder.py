"""An encoder whose coupling slips once, on the way to a pose."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.defect import spread
from simulators.streams.course import Course

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SlippingEncoder:
    """Encoder of one joint that reads `slip_rad` more after `share` of the session."""

    joint: int
    slip_rad: float
    share: float

    KIND: ClassVar[str] = "stream-slipping-encoder"
    PHYSICS: ClassVar[str] = "encoder-slip"

    @property
    def port(self) -> str:
        return f"joint{self.joint}.angle"

    @property
    def drivers(self) -> tuple[str, ...]:
        return ("t",)

    @property
    def figures(self) -> Mapping[str, float]:
        return {"slip_rad": self.slip_rad}

    @property
    def size(self) -> float:
        return abs(self.slip_rad) / 6e-6

    @classmethod
    def draw(cls, rng: np.random.Generator, n_joints: int) -> Self:
        slip_rad = spread(rng, 1.5e-4) * float(rng.choice([-1.0, 1.0]))
        return cls(int(rng.integers(1, n_joints + 1)), slip_rad, float(rng.uniform(0.25, 0.75)))

    def read_rad(self, course: Course, q_rad: Floats) -> Floats:
        read = q_rad.copy()
        read[:, self.joint - 1] += np.where(course.time_s >= self.share * course.time_s[-1], self.slip_rad, 0.0)
        return read
