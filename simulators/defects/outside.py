"""In no catalogue: a joint is pulled by something that depends on two other joints, and goes into saturation."""

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
class SaturatedProduct:
    """Joint that turns by `turn_rad` tanh(2 sin(qa) sin(qb))."""

    joint: int
    one: int
    other: int
    turn_rad: float

    KIND: ClassVar[str] = "outside-product"
    PHYSICS: ClassVar[str] = "unknown"
    SIZE: ClassVar[str] = "turn_rad"
    TYPICAL: ClassVar[float] = 6e-5
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ANY_INSTRUMENT
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return f"joint{self.joint}.angle"

    @property
    def drivers(self) -> tuple[str, ...]:
        return (f"q{self.one}", f"q{self.other}")

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        one, other, joint = (int(number) + 1 for number in rng.permutation(site.n_joints)[:3])
        return cls(joint, one, other, spread(rng, cls.TYPICAL))

    def reading_error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        error_rad = np.zeros_like(shaft_rad)
        pull = np.tanh(2.0 * np.sin(shaft_rad[:, self.one - 1]) * np.sin(shaft_rad[:, self.other - 1]))
        error_rad[:, self.joint - 1] = -self.turn_rad * pull
        return error_rad
