"""Mechanisms between a joint's output and the start of the next joint."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import Vector, shifted, turned, turned_about
from simulators.arm.statics import Load
from simulators.defects.defect import ANY_INSTRUMENT, ROBOT, Defect, UnderWeights, phase
from simulators.defects.scene import Scene, Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class _OneLink(Defect):
    link: int

    @property
    def links(self) -> tuple[int, ...]:
        return (self.link,)


@dataclass(frozen=True)
class _LoadedLink(_OneLink):
    PHYSICS = "link-bending"
    PORT = "link{link}.tilt"
    INSTRUMENTS = ROBOT

    @property
    def drivers(self) -> tuple[str, ...]:
        return (f"gravity_torque{self.link}", f"gravity_torque{self.link + 1}")


@dataclass(frozen=True)
class BendingLink(_LoadedLink):
    """A link that bends like a clamped beam, with `bending_per_nm2` = 1 / (E I), under the weight at its end.

    End load F across it and moment M at the end: deflection F L^3 / 3EI + M L^2 / 2EI, slope F L^2 / 2EI + M L / EI
    (clamped beam of constant section, alike about all axes across it; any text on strength of materials). The link's
    own weight counts as hung at its end; a `light` link has none.
    """

    bending_per_nm2: float
    light: bool = False

    KIND = "bending-link"
    SIZE = "bending_per_nm2"
    TYPICAL = 5e-5  # aluminium tube of 50 mm and 5 mm wall
    FIGURES = ("bending_per_nm2",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.long_link(rng, carrying=True), cls.draw_size(rng))

    def link_motion(self, link: int, end_m: Floats, angle_rad: Floats, scene: Scene, load: Load) -> Floats:
        moment_nm, force_n = (load.beyond_nm, load.beyond_n) if self.light else (load.moment_nm, load.force_n)
        sag_m, slope_rad = cantilever(end_m, moment_nm[:, link], force_n[:, link])
        bend = self.bending_per_nm2
        return shifted(bend * sag_m) @ turned_about(end_m, bend * slope_rad)


def cantilever(end_m: Floats, moment_nm: Floats, force_n: Floats) -> tuple[Floats, Floats]:
    """Sag and slope of the end of a clamped beam, each (row, 3), for 1 / (E I) = 1.

    Moment about its start and force (row, 3), all in the frame at its start.
    """
    length_m = float(np.linalg.norm(end_m))
    along = end_m / length_m
    across_n = force_n - (force_n @ along)[:, np.newaxis] * along
    end_nm = moment_nm - np.cross(end_m, force_n)
    end_nm = end_nm - (end_nm @ along)[:, np.newaxis] * along
    sag_m = across_n * length_m**3 / 3.0 + np.cross(end_nm, along) * length_m**2 / 2.0
    slope_rad = np.cross(along, across_n) * length_m**2 / 2.0 + end_nm * length_m
    return sag_m, slope_rad


@dataclass(frozen=True)
class FlatLink(_LoadedLink):
    """A link of a flat section: a clamped beam that is softer about one axis across it than about the other.

    1 / (E I) is `about_u_per_nm2` for bending about `axis_u`, a direction across the link in the frame at its start,
    and `about_v_per_nm2` for bending about the third direction (principal axes of a section). It weighs nothing itself.
    """

    about_u_per_nm2: float
    about_v_per_nm2: float
    axis_u: Vector
    share: float = 1.0

    KIND = "flat-link"

    def link_motion(self, link: int, end_m: Floats, angle_rad: Floats, scene: Scene, load: Load) -> Floats:
        sag_m, slope_rad = cantilever(end_m, load.beyond_nm[:, link], load.beyond_n[:, link])
        u, along = np.asarray(self.axis_u), end_m / np.linalg.norm(end_m)
        v = np.cross(along, u)
        gives = self.about_u_per_nm2 * np.outer(u, u) + self.about_v_per_nm2 * np.outer(v, v)
        sags = self.about_u_per_nm2 * np.outer(v, v) + self.about_v_per_nm2 * np.outer(u, u)  # about u it sags along v
        return shifted(self.share * sag_m @ sags) @ turned_about(end_m, self.share * slope_rad @ gives)


@dataclass(frozen=True)
class BeamUnderWeights(UnderWeights, _LoadedLink):
    """A clamped beam under other weights than the stated masses; its compliance is L / (E I), a slope for a moment."""

    KIND = "beam-under-weights"

    def link_motion(self, link: int, end_m: Floats, angle_rad: Floats, scene: Scene, load: Load) -> Floats:
        sag_m, slope_rad = cantilever(end_m, *self.felt(scene, load, link, first=link + 1))
        share = self.share / float(np.linalg.norm(end_m))
        return shifted(share * sag_m) @ turned_about(end_m, share * slope_rad)


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
class HeatedLink(_OneLink, Growth):
    """Link that its motor warms, and that grows by `expansion_per_k`."""

    expansion_per_k: float
    where: str = ""  # the thermometer that says how warm it is; "": its own

    KIND = "heated-link"
    PORT = "link{link}.length"
    DRIVERS = ("temp_link{link}",)
    NEEDS = ("temp_link{link}_degC",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.long_link(rng), cls.draw_size(rng))

    def link_motion(self, link: int, end_m: Floats, angle_rad: Floats, scene: Scene, load: Load) -> Floats:
        warmed_k = scene.warmed_k(self.where or f"link{link}")
        return shifted(self.expansion_per_k * warmed_k[:, np.newaxis] * end_m)


@dataclass(frozen=True)
class LaggingLink(HeatedLink):
    """Link whose casting follows the thermometer on its skin with one time constant, and grows by `expansion_per_k`.

    A body of one thermal mass behind its skin (Newton's law of cooling): dT / dt = (skin - T) / time constant, exact
    for a skin whose temperature goes straight from sample to sample; at the first sample both are alike.
    """

    time_constant_s: float = 1800.0

    KIND = "lagging-link"
    FIGURES = ("expansion_per_k", "lag_s=time_constant_s")

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.long_link(rng), cls.draw_size(rng), "", float(rng.uniform(900.0, 2700.0)))

    def link_motion(self, link: int, end_m: Floats, angle_rad: Floats, scene: Scene, load: Load) -> Floats:
        t_s, skin_k = scene.t_s, scene.warmed_k(self.where or f"link{link}")
        inside_k = skin_k.copy()
        for row in range(1, t_s.size):
            step_s = max(t_s[row] - t_s[row - 1], 1e-9)
            keep = np.exp(-step_s / self.time_constant_s)
            behind_k = (skin_k[row] - skin_k[row - 1]) * self.time_constant_s / step_s
            inside_k[row] = skin_k[row] - behind_k + (inside_k[row - 1] - skin_k[row - 1] + behind_k) * keep
        return shifted(self.expansion_per_k * inside_k[:, np.newaxis] * end_m)


@dataclass(frozen=True)
class WarmArm(Growth):
    """Arm that grows with the room by `expansion_per_k`, every link alike."""

    expansion_per_k: float
    joints: int
    where: str = "room"  # the thermometer that says how warm it is
    first: int = 0  # the first link that grows

    KIND = "warm-arm"
    PORT = "link*.length"
    DRIVERS = ("temp_room",)
    NEEDS = ("temp_room_degC",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(cls.draw_size(rng), site.n_joints)

    @property
    def links(self) -> tuple[int, ...]:
        return tuple(range(self.first, self.joints + 1))

    def link_motion(self, link: int, end_m: Floats, angle_rad: Floats, scene: Scene, load: Load) -> Floats:
        return shifted(self.expansion_per_k * scene.warmed_k(self.where)[:, np.newaxis] * end_m)


@dataclass(frozen=True)
class WarmingUp(Defect):
    """Links that grow while the machine warms up: by `growth` (no unit) in the end, with one time constant.

    A body of one thermal mass under a steady source of heat: 1 - exp(-t / time constant), counted from `start_s`.
    """

    first: int
    last: int
    growth: float
    time_constant_s: float
    start_s: float = 0.0

    KIND = "warming-up"
    PHYSICS = "link-thermal-growth"
    PORT = "link{first}.length"
    DRIVERS = ("t",)
    SIZE = "growth"
    TYPICAL = 1e-4
    INSTRUMENTS = ANY_INSTRUMENT

    @property
    def links(self) -> tuple[int, ...]:
        return tuple(range(self.first, self.last + 1))

    def link_motion(self, link: int, end_m: Floats, angle_rad: Floats, scene: Scene, load: Load) -> Floats:
        warm = 1.0 - np.exp(-(scene.t_s - self.start_s) / self.time_constant_s)
        return shifted(self.growth * warm[:, np.newaxis] * end_m)
