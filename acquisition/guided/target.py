"""What a person is asked to put the probe on: a cone, one end of a bar, a spot of a sphere."""

from collections.abc import Mapping
from dataclasses import dataclass

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
        """What the row says of it, in the words of samples.csv."""
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
