"""Mechanisms that no catalogue lists, at any place of the chain: a diagnosis has to find them without a name."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import Vector, turned
from simulators.arm.statics import Load
from simulators.defects.defect import ANY_INSTRUMENT, UNKNOWN, Defect, direction, phase
from simulators.defects.detector import PsdDefect, either_psd
from simulators.defects.drive import DriveDefect
from simulators.defects.encoder import ControllerEncoderDefect
from simulators.defects.scene import Light, Scene, Site
from simulators.defects.tool import MountDefect

Floats = NDArray[np.float64]


class TurnedJoint(ControllerEncoderDefect):
    """Something that turns a joint beyond its encoder, whatever weight does to the arm."""

    PHYSICS = UNKNOWN


@dataclass(frozen=True)
class PulledByTwo(TurnedJoint):
    """A joint that two other joints turn, together."""

    one: int
    other: int
    turn_rad: float

    DRIVERS = ("q{one}", "q{other}")
    SIZE = "turn_rad"


@dataclass(frozen=True)
class SaturatedProduct(PulledByTwo):
    """A pull that depends on two other joints and saturates: the joint turns by `turn_rad` tanh(2 sin(qa) sin(qb))."""

    KIND = "outside-product"
    TYPICAL = 6e-5

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        one, other, joint = (int(number) + 1 for number in rng.permutation(site.n_joints)[:3])
        return cls(joint, one, other, cls.draw_size(rng))

    def error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        return -self.turn_rad * np.tanh(2.0 * np.sin(shaft_rad[:, self.one - 1]) * np.sin(shaft_rad[:, self.other - 1]))


@dataclass(frozen=True)
class NarrowBump(TurnedJoint):
    """A chip under a tooth lifts a joint by `height_rad` in one narrow range of its angle, around `at_rad`."""

    height_rad: float
    at_rad: float
    width_rad: float

    KIND = "outside-bump"
    SIZE = "height_rad"
    TYPICAL = 2e-4

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        joint = site.any_joint(rng)
        height_rad, at_rad = cls.draw_size(rng), float(rng.uniform(*site.usual_rad[joint - 1]))
        return cls(joint, height_rad, at_rad, float(rng.uniform(0.08, 0.2)))

    def error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        own_rad = shaft_rad[:, self.joint - 1]
        return -self.height_rad * np.exp(-0.5 * ((own_rad - self.at_rad) / self.width_rad) ** 2)


@dataclass(frozen=True)
class CableBundle(PulledByTwo):
    """A cable bundle between two joints winds up and pulls a third.

    Its torque grows with the product of the two turns that wind it: `turn_rad` for each square radian.
    """

    KIND = "outside-cable"
    TYPICAL = 4e-5

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(int(rng.integers(3, site.n_joints + 1)), 1, 2, cls.draw_size(rng))

    def error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        return -self.turn_rad * shaft_rad[:, self.one - 1] * shaft_rad[:, self.other - 1]


@dataclass(frozen=True)
class StickingPad(TurnedJoint):
    """A brake pad grips at a random level each time: the joint rests `turn_rad` low, even or high.

    Nothing that is recorded shows at which.
    """

    turn_rad: float
    dice: int

    KIND = "outside-sticking"
    DRIVERS = ()
    SIZE = "turn_rad"
    TYPICAL = 6e-5

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.any_joint(rng), cls.draw_size(rng), int(rng.integers(2**31)))

    def error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        level = np.random.default_rng(self.dice).integers(-1, 2, len(scene))
        return np.asarray(self.turn_rad * level, dtype=np.float64)


@dataclass(frozen=True)
class GearBeat(TurnedJoint):
    """Two gear trains on one shaft beat, once per turn of one joint less two of another.

    The joint turns by `turn_rad` sin(qi - 2 qj + phase).
    """

    other: int
    turn_rad: float
    bearing_rad: float

    KIND = "outside-beat"
    DRIVERS = ("q{joint}", "q{other}")
    SIZE = "turn_rad"
    TYPICAL = 6e-5

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        joint, other = (int(number) + 1 for number in rng.permutation(site.n_joints)[:2])
        return cls(joint, other, cls.draw_size(rng), phase(rng))

    def error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        beat_rad = shaft_rad[:, self.joint - 1] - 2.0 * shaft_rad[:, self.other - 1] + self.bearing_rad
        return -self.turn_rad * np.sin(beat_rad)


@dataclass(frozen=True)
class UnevenSpring(DriveDefect):
    """A drive whose stiffness goes up and down three times a turn, as its three planets take the load in turn.

    It turns `compliance_rad_nm` (1 + 0.9 sin(3 q + phase)) per newton metre.
    """

    compliance_rad_nm: float
    bearing_rad: float

    KIND = "outside-uneven-spring"
    PHYSICS = UNKNOWN
    DRIVERS = ("gravity_torque{joint}", "q{joint}")
    SIZE = "compliance_rad_nm"
    TYPICAL = 8e-6

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.loaded_joint(rng), cls.draw_size(rng), phase(rng))

    def turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        own = self.joint - 1
        uneven = 1.0 + 0.9 * np.sin(3.0 * shaft_rad[:, own] + self.bearing_rad)
        return self.compliance_rad_nm * uneven * load.torque_nm[:, own]


@dataclass(frozen=True)
class FanOnBracket(MountDefect):
    """A bracket of two metals in the draught of a cabinet fan turns the tool aside, as fast as the fan runs.

    By `turn_rad` per 1000 rpm.
    """

    turn_rad: float
    axis: Vector
    at_laser: bool

    KIND = "outside-fan"
    PHYSICS = UNKNOWN
    DRIVERS = ("fan_rpm",)
    SIZE = "turn_rad"
    TYPICAL = 5e-5
    NEEDS = ("fan_rpm",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(cls.draw_size(rng), direction(rng), site.instrument == "dual-psd")

    def tool_motion(self, scene: Scene, load: Load) -> Floats:
        speed = (scene.extra["fan_rpm"] - scene.extra["fan_rpm"][0]) / 1000.0
        return turned(self.turn_rad * speed[:, np.newaxis] * np.asarray(self.axis))


@dataclass(frozen=True)
class Fringes(PsdDefect):
    """A window in front of a PSD makes fringes with the laser: the reading ripples by `ripple_m` across the face."""

    ripple_m: float
    period_m: float
    towards_rad: float

    KIND = "outside-fringes"
    PHYSICS = UNKNOWN
    SIZE = "ripple_m"
    TYPICAL = 4e-6

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        period_m = float(rng.uniform(0.25, 0.6) * site.half_size_m)
        return cls(either_psd(rng), cls.draw_size(rng), period_m, phase(rng))

    def seen_m(self, own_m: Floats, light: Light, scene: Scene) -> Floats:
        along = np.array([np.cos(self.towards_rad), np.sin(self.towards_rad)])
        ripple_m = self.ripple_m * np.sin(2.0 * np.pi * (own_m @ along) / self.period_m)
        return own_m + ripple_m[:, np.newaxis] * along


@dataclass(frozen=True)
class BentRay(Defect):
    """Warm air above a cold floor: its index falls by `gradient_per_m` with height, and bends the tracker's beam.

    A gradient g of the refractive index with height bends a level ray to a parabola: the target seems higher by g r^2 /
    2 for a distance r (geometrical optics; about 1e-6 per metre for 1 K/m, Ciddor, Appl. Opt. 35 (1996) 1566).
    """

    gradient_per_m: float

    KIND = "outside-refraction"
    PHYSICS = UNKNOWN
    PORT = "device.reading"
    DRIVERS = ("reading",)
    SIZE = "gradient_per_m"
    TYPICAL = 3e-6
    INSTRUMENTS = ("position",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(cls.draw_signed(rng))

    def seen_position_m(self, position_m: Floats, scene: Scene) -> Floats:
        seen_m = position_m.copy()
        seen_m[:, 2] += 0.5 * self.gradient_per_m * np.sum(position_m**2, axis=1)
        return seen_m


@dataclass(frozen=True)
class DragChain(Defect):
    """A drag chain hits a stop when joint 1 turns far to one side, and leans on the pedestal.

    By `lean_rad_rad` per radian of joint 1 beyond its middle.
    """

    lean_rad_rad: float
    about: Vector
    from_rad: float

    KIND = "outside-drag-chain"
    PHYSICS = UNKNOWN
    PORT = "base.pose"
    DRIVERS = ("q1",)
    SIZE = "lean_rad_rad"
    TYPICAL = 5e-5
    INSTRUMENTS = ANY_INSTRUMENT

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(cls.draw_size(rng), direction(rng), 0.5 * sum(site.usual_rad[0]))

    def base_motion(self, scene: Scene, load: Load) -> Floats:
        beyond_rad = np.maximum(scene.goal_rad[:, 0] - self.from_rad, 0.0)
        return turned(self.lean_rad_rad * beyond_rad[:, np.newaxis] * np.asarray(self.about))
