"""A device that reads, waits, and then stamps: an interrupt that is served late, a queue on the bus."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from simulators.defects.defect import spread


@dataclass(frozen=True)
class LateStamps:
    """Encoders whose stamps are `by_s` late."""

    by_s: float
    joints: int

    KIND: ClassVar[str] = "stream-late-stamps"
    PHYSICS: ClassVar[str] = "latency"

    @property
    def port(self) -> str:
        return "time"

    @property
    def drivers(self) -> tuple[str, ...]:
        return tuple(f"qd{joint}" for joint in range(1, self.joints + 1))

    @property
    def figures(self) -> Mapping[str, float]:
        return {"latency_s": self.by_s}

    @property
    def size(self) -> float:
        return self.by_s / 2e-4  # of what a line usually delays

    @classmethod
    def draw(cls, rng: np.random.Generator, n_joints: int) -> Self:
        return cls(spread(rng, 3e-3), n_joints)

    def late_s(self, device: str) -> float:
        return self.by_s if device == "encoders" else 0.0
