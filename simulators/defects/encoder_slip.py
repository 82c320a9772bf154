"""An encoder whose coupling slips once: from then on it reads a constant amount too much."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.directions import ANY_INSTRUMENT, spread
from simulators.defects.scene import Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class EncoderSlip:
    """Encoder of one joint that reads `slip_rad` more from `at_s` on."""

    joint: int
    slip_rad: float
    at_s: float

    KIND: ClassVar[str] = "encoder-slip"
    PHYSICS: ClassVar[str] = "encoder-slip"
    SIZE: ClassVar[str] = "slip_rad"
    TYPICAL: ClassVar[float] = 1e-4
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ANY_INSTRUMENT
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return f"joint{self.joint}.angle"

    @property
    def drivers(self) -> tuple[str, ...]:
        return ("t",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {"at_s": self.at_s, "step_rad": self.slip_rad}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(
            site.any_joint(rng),
            spread(rng, cls.TYPICAL) * float(rng.choice([-1.0, 1.0])),
            float(rng.uniform(0.25, 0.75) * site.duration_s),
        )

    def reading_error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        error_rad = np.zeros_like(shaft_rad)
        error_rad[:, self.joint - 1] = np.where(scene.t_s >= self.at_s, self.slip_rad, 0.0)
        return error_rad
