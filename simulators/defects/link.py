"""Mechanisms between a joint's output and the start of the next joint."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.arm.rigid import shifted, turned, turned_about
from simulators.arm.statics import Load
from simulators.defects.defect import ANY_INSTRUMENT, ROBOT, Defect, phase
from simulators.defects.scene import Scene, Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class BendingLink(Defect):
    """A link that bends like a clamped beam, with `bending_per_nm2` = 1 / (E I), under the weight at its end.

    End load F across it and moment M at the end: deflection F L^3 / 3EI + M L^2 / 2EI, slope F L^2 / 2EI + M L / EI
    (clamped beam of constant section, alike about all axes across it; any text on strength of materials). The link's
    own weight counts as hung at its end.
    """

    link: int
    bending_per_nm2: float

    KIND = "bending-link"
    PHYSICS = "link-bending"
    PORT = "link{link}.tilt"
    SIZE = "bending_per_nm2"
    TYPICAL = 5e-5  # aluminium tube of 50 mm and 5 mm wall
    INSTRUMENTS = ROBOT
    FIGURES = ("bending_per_nm2",)

    @property
    def drivers(self) -> tuple[str, ...]:
        return (f"gravity_torque{self.link}", f"gravity_torque{self.link + 1}")

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.long_link(rng, carrying=True), cls.draw_size(rng))

    @property
    def links(self) -> tuple[int, ...]:
        return (self.link,)

    def link_motion(self, link: int, end_m: Floats, angle_rad: Floats, scene: Scene, load: Load) -> Floats:
        length_m = float(np.linalg.norm(end_m))
        along = end_m / length_m
        force_n, moment_nm = load.force_n[:, link], load.moment_nm[:, link]
        across_n = force_n - (force_n @ along)[:, np.newaxis] * along
        end_nm = moment_nm - np.cross(end_m, force_n)
        end_nm = end_nm - (end_nm @ along)[:, np.newaxis] * along
        sag_m = across_n * length_m**3 / 3.0 + np.cross(end_nm, along) * length_m**2 / 2.0
        slope_rad = np.cross(along, across_n) * length_m**2 / 2.0 + end_nm * length_m
        bend = self.bending_per_nm2
        return shifted(bend * sag_m) @ turned_about(end_m, bend * slope_rad)


@dataclass(frozen=True)
class WornBearing(Defect):
    """A worn bearing: the axis of a joint leans by `lean_rad` while it turns, in a pattern of the rolling elements.

    Seen from the housing the axis leans towards (cos(k q + b), sin(k q + b)), k = `cycles`, positive in the joint's own
    sense: races with 2 or 3 lobes give k = +-2, +-3, a bent race in the housing against a bent shaft k = -1 (Bryan,
    Clouser and Holland, "Spindle accuracy", American Machinist 1967: error motions). k = +1 would turn with the joint,
    and is geometry.
    """

    joint: int
    lean_rad: float
    cycles: int
    bearing_rad: float

    KIND = "worn-bearing"
    PHYSICS = "axis-wobble"
    PORT = "link{joint}.tilt"
    DRIVERS = ("q{joint}",)
    SIZE = "lean_rad"
    TYPICAL = 3e-5
    INSTRUMENTS = ANY_INSTRUMENT

    @property
    def figures(self) -> dict[str, float]:
        sense = float(np.sign(self.cycles))
        return {"amplitude_rad": abs(self.lean_rad), "order": float(abs(self.cycles)), "sense": sense}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        joint = site.any_joint(rng)
        return cls(joint, cls.draw_size(rng), int(rng.choice([-3, -2, -1, 2, 3])), phase(rng))

    @property
    def links(self) -> tuple[int, ...]:
        return (self.joint,)

    def link_motion(self, link: int, end_m: Floats, angle_rad: Floats, scene: Scene, load: Load) -> Floats:
        turn_rad = angle_rad[:, self.joint - 1]
        towards_rad = (self.cycles - 1) * turn_rad + self.bearing_rad  # seen from the frame that turns with the joint
        lean = np.stack((np.cos(towards_rad), np.sin(towards_rad), np.zeros_like(towards_rad)), axis=1)
        return turned(self.lean_rad * lean)


class Growth(Defect):
    """Links that grow along the line between their joints, in proportion to a temperature.

    Length times expansion coefficient times temperature difference (aluminium 23e-6/K, cast iron 11e-6/K: any handbook
    of materials).
    """

    PHYSICS = "link-thermal-growth"
    SIZE = "expansion_per_k"
    TYPICAL = 23e-6
    LARGEST: ClassVar[float] = 60e-6  # aluminium, and a thermometer that sees less than half of the warmth
    INSTRUMENTS = ANY_INSTRUMENT
    FIGURES = ("expansion_per_k",)


@dataclass(frozen=True)
class HeatedLink(Growth):
    """Link that its motor warms, and that grows by `expansion_per_k`."""

    link: int
    expansion_per_k: float

    KIND = "heated-link"
    PORT = "link{link}.length"
    DRIVERS = ("temp_link{link}",)
    NEEDS = ("temp_link{link}_degC",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.long_link(rng), cls.draw_size(rng))

    @property
    def links(self) -> tuple[int, ...]:
        return (self.link,)

    def link_motion(self, link: int, end_m: Floats, angle_rad: Floats, scene: Scene, load: Load) -> Floats:
        return shifted(self.expansion_per_k * scene.warmed_k(f"link{link}")[:, np.newaxis] * end_m)


@dataclass(frozen=True)
class WarmArm(Growth):
    """Arm that grows with the room by `expansion_per_k`, every link alike."""

    expansion_per_k: float
    joints: int

    KIND = "warm-arm"
    PORT = "link*.length"
    DRIVERS = ("temp_room",)
    NEEDS = ("temp_room_degC",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(cls.draw_size(rng), site.n_joints)

    @property
    def links(self) -> tuple[int, ...]:
        return tuple(range(self.joints + 1))

    def link_motion(self, link: int, end_m: Floats, angle_rad: Floats, scene: Scene, load: Load) -> Floats:
        return shifted(self.expansion_per_k * scene.warmed_k("room")[:, np.newaxis] * end_m)
