"""Parts of the set-up that move as a whole while a session lasts: at once, slowly to an end, or with temperature."""

from dataclasses import dataclass
from typing import ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import Vector, moved, shifted, turned_about
from simulators.defects.defect import Defect, direction
from simulators.defects.scene import Scene, Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Displacement(Defect):
    """Moves by `shift_m`, and turns about `turn_rad_m` for each metre of it."""

    shift_m: float
    along: Vector
    turn_rad_m: float
    about: Vector

    DRIVERS = ("t",)
    SIZE = "shift_m"
    TURNS_RAD_M: ClassVar[tuple[float, float]]  # range of `turn_rad_m`

    def gone_m(self, scene: Scene) -> Floats:
        """(row,) how far on its way."""
        raise NotImplementedError

    def motion(self, scene: Scene) -> Floats:
        """(row, 4, 4) of the part in its own frame."""
        far_m = self.gone_m(scene)[:, np.newaxis]
        return moved(far_m * np.asarray(self.along), self.turn_rad_m * far_m * np.asarray(self.about))

    @classmethod
    def _draw_way(cls, rng: np.random.Generator) -> tuple[float, Vector, float, Vector]:
        return cls.draw_size(rng), direction(rng), float(rng.uniform(*cls.TURNS_RAD_M)), direction(rng)


@dataclass(frozen=True)
class Bump(Displacement):
    """Knocked: from `at_s` on it stands elsewhere."""

    at_s: float

    FIGURES = ("at_s", "shift_m")

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        at_s = site.middle_s(rng)
        return cls(*cls._draw_way(rng), at_s)

    def gone_m(self, scene: Scene) -> Floats:
        return np.where(scene.t_s >= self.at_s, self.shift_m, 0.0)


@dataclass(frozen=True)
class BriefShift(Bump):
    """Knocked, and pushed back: from `until_s` on it stands where it stood before `at_s`."""

    until_s: float

    FIGURES = ("at_s", "shift_m", "until_s")

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        at_s = float(rng.uniform(0.15, 0.45) * site.duration_s)
        until_s = at_s + float(rng.uniform(0.2, 0.4) * site.duration_s)
        return cls(*cls._draw_way(rng), at_s, until_s)

    def gone_m(self, scene: Scene) -> Floats:
        return np.where((scene.t_s >= self.at_s) & (scene.t_s < self.until_s), self.shift_m, 0.0)


@dataclass(frozen=True)
class Settling(Displacement):
    """Slowly moves and turns, more slowly as time goes on: by `shift_m` in the end, with one time constant."""

    time_constant_s: float

    FIGURES = ("shift_m", "time_constant_s")

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        time_constant_s = float(rng.uniform(0.2, 0.6) * site.duration_s)
        return cls(*cls._draw_way(rng), time_constant_s)

    def gone_m(self, scene: Scene) -> Floats:
        return self.shift_m * (1.0 - np.exp(-scene.t_s / self.time_constant_s))


Course = Literal["step", "while", "settling", "steady", "warmth"]


@dataclass(frozen=True)
class CarriedPart(Defect):
    """A part that is carried away: by `shift_m`, and turned by `turn_rad` about `about_m`, in its own frame.

    `course` states when: all of it from `at_s` on ("step"), or for `over_s` only ("while"); slowly to that end with
    the time constant `over_s`, from `at_s` on ("settling"); by that much in every `over_s`, steadily ("steady"); by
    that much for each kelvin at `where` ("warmth").
    """

    shift_m: Vector
    turn_rad: Vector
    about_m: Vector
    course: Course
    at_s: float = 0.0
    over_s: float = 1.0
    where: str = ""
    share: float = 1.0

    DRIVERS = ("t",)

    def carried(self, scene: Scene) -> Floats:
        """Motion (row, 4, 4) of the part in its own frame."""
        gone = self.share * self._gone(scene)[:, np.newaxis]
        turned = turned_about(np.asarray(self.about_m), gone * np.asarray(self.turn_rad))
        return shifted(gone * np.asarray(self.shift_m)) @ turned

    def carried_where(self, here: NDArray[np.bool_], scene: Scene) -> Floats:
        """The same in the rows `here`; in all others it stays."""
        return np.where(here[:, np.newaxis, np.newaxis], self.carried(scene), np.eye(4))

    def _gone(self, scene: Scene) -> Floats:
        """(row,) how much of the way."""
        since_s = scene.t_s - self.at_s
        match self.course:
            case "step":
                return (since_s >= 0.0).astype(np.float64)
            case "while":
                return ((since_s >= 0.0) & (since_s < self.over_s)).astype(np.float64)
            case "settling":
                return -np.expm1(-since_s / self.over_s)
            case "steady":
                return since_s / self.over_s
            case "warmth":
                return scene.warmed_k(self.where)
