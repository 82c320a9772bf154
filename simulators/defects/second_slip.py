"""The coupling of a second encoder slips once: the controller's own reading is right, and so is the arm."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.directions import spread
from simulators.defects.encoder_slip import EncoderSlip
from simulators.defects.scene import Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SecondSlip:
    """Second encoder of one joint that reads `slip_rad` more from `at_s` on."""

    joint: int
    slip_rad: float
    at_s: float

    KIND: ClassVar[str] = "second-encoder-slip"
    PHYSICS: ClassVar[str] = "encoder-slip"
    SIZE: ClassVar[str] = "slip_rad"
    TYPICAL: ClassVar[float] = EncoderSlip.TYPICAL
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ()  # no instrument at the flange shows it
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
        sign = float(rng.choice([-1.0, 1.0]))
        at_s = float(rng.uniform(0.25, 0.75) * site.duration_s)
        return cls(site.any_joint(rng), spread(rng, cls.TYPICAL) * sign, at_s)

    def second_error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        slip = EncoderSlip(self.joint, self.slip_rad, self.at_s)
        return slip.reading_error_rad(shaft_rad, scene)
