"""What a person puts the probe on (a cone, one end of a bar, a spot of a sphere), the reading taken there, and its
judge.

A reading is the mean of the encoders while the probe was held. Whether it can be is judged by the arm as known so far,
which is passed in, for fits are not made here.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.samples import Cell

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Cone:
    """Cone `id`, about at `point_m` in the base."""

    id: int
    point_m: Vector

    @property
    def says(self) -> str:
        return f"cone {self.id}"

    @property
    def columns(self) -> Mapping[str, Cell]:
        """Its row, in the words of samples.csv."""
        return {"seat": self.id}


@dataclass(frozen=True)
class BarEnd:
    """End a or b of a bar as it is set up in one of its positions."""

    position: int
    bar: int
    end: str
    point_m: Vector

    @property
    def says(self) -> str:
        return f"end {self.end} of bar {self.bar}, position {self.position}"

    @property
    def columns(self) -> Mapping[str, Cell]:
        return {"bar": self.bar, "bar_end": self.end}


@dataclass(frozen=True)
class SphereSpot:
    """A sphere touched from the side of `direction` (unit); `point_m` is then the middle of the probe's ball."""

    id: int
    direction: Vector
    series: int  # touches of one number are of one test, made with the probe about alike (guided/plan.py)
    point_m: Vector

    @property
    def says(self) -> str:
        x, y, z = self.direction
        return f"sphere {self.id} from ({x:+.1f}, {y:+.1f}, {z:+.1f}), series {self.series}"

    @property
    def columns(self) -> Mapping[str, Cell]:
        return {"sphere": self.id, "series": self.series}


Target = Cone | BarEnd | SphereSpot


Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Reading:
    """A row of the samples in the making."""

    target: Target
    q_rad: Floats  # (n,)
    t_s: float  # since the session began, of the encoders' own time
    host_s: float

    def row(self) -> dict[str, Cell]:
        """Column name -> value; names of the session-folder format, version 1."""
        angles = {f"q{i + 1}_rad": float(q) for i, q in enumerate(self.q_rad)}
        return {"t_s": self.t_s, **angles, **self.target.columns}


@dataclass(frozen=True)
class Doubt:
    """How far a reading is from where it should be."""

    miss_m: float
    sigmas: float  # of all that is not known yet, arm and noise together

    @property
    def says(self) -> str:
        return f"{1e3 * self.miss_m:.2f} mm ({self.sigmas:.0f} sigma) off; the probe slipped or sits on the rim"


class Judge(Protocol):
    """Learns from what was accepted."""

    def learn(self, readings: Sequence[Reading]) -> None: ...

    def doubt(self, visit: Sequence[Reading]) -> Doubt | None:
        """Of the readings of one visit, against all learned; None where nothing speaks against them."""
        ...

    @property
    def repeatability_m(self) -> float | None:
        """Rms of the probe about its place in each cone, three axes together; None before any was taken twice."""
        ...
