"""An encoder behind a filter of its own: a first-order lag between shaft and reading."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from simulators.defects.defect import spread
from simulators.streams.course import STEP_S, Course

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class LaggingEncoder:
    """Encoder of one joint with a filter of `time_constant_s`."""

    joint: int
    time_constant_s: float

    KIND: ClassVar[str] = "stream-lagging-encoder"
    PHYSICS: ClassVar[str] = "reading-lag"

    @property
    def port(self) -> str:
        return f"joint{self.joint}.angle"

    @property
    def drivers(self) -> tuple[str, ...]:
        return (f"qd{self.joint}",)

    @property
    def figures(self) -> Mapping[str, float]:
        return {"behind_s": self.time_constant_s}

    @property
    def size(self) -> float:
        return self.time_constant_s * 0.5 / 6e-6  # at a usual speed, over an encoder's noise

    @classmethod
    def draw(cls, rng: np.random.Generator, n_joints: int) -> Self:
        return cls(int(rng.integers(1, n_joints + 1)), spread(rng, 3e-3))

    def read_rad(self, course: Course, q_rad: Floats) -> Floats:
        read = q_rad.copy()
        own_rad, keep = q_rad[:, self.joint - 1], float(np.exp(-STEP_S / self.time_constant_s))
        read[:, self.joint - 1] = own_rad[0] + lfilter([0.0, 1.0 - keep], [1.0, -keep], own_rad - own_rad[0])
        return read
