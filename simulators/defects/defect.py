"""What a mechanism is, and the places where it may take hold of the chain, in the order of the signal.

A defect is a frozen record of what is physically wrong, with one quantity (`SIZE`) that scales it: zero changes
nothing. It takes hold by having one or more of the methods of the protocols below; the chain finds them and calls
each at its place.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Protocol, Self, TypeVar, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import Vector
from simulators.arm.statics import Load, Weight, carried_by, loaded_by
from simulators.defects.scene import Light, Scene, Site

Floats = NDArray[np.float64]
ANY_INSTRUMENT = ("dual-psd", "position", "wire", "seat")
ROBOT = ("dual-psd", "position", "wire")  # arms with drives
SPOTS = ("dual-psd",)
UNKNOWN = "unknown"  # physics that no catalogue lists


@dataclass(frozen=True)
class Mechanism:
    """What has a name, a port and figures in the words of a diagnosis. {Braces} stand for fields of the record."""

    KIND: ClassVar[str]  # the mechanism's own name
    PHYSICS: ClassVar[str]  # as in the interchange format; UNKNOWN when no catalogue has it
    PORT: ClassVar[str]  # where it sits: "joint{joint}.angle", as in the interchange format
    DRIVERS: ClassVar[tuple[str, ...]]  # what it depends on: "q{joint}", as in the interchange format
    EVERY_JOINT: ClassVar[str] = ""  # in place of DRIVERS: "qd", where it depends on that of all its `joints`
    FIGURES: ClassVar[tuple[str, ...]] = ()  # fields that a diagnosis states; "its name=field" where the names differ
    ALSO: ClassVar[tuple[str, ...]] = ()  # physics that is truly at this port, too, as a part of the mechanism

    @property
    def port(self) -> str:
        return self.PORT.format_map(vars(self))

    @property
    def drivers(self) -> tuple[str, ...]:
        if self.EVERY_JOINT:
            return tuple(f"{self.EVERY_JOINT}{joint}" for joint in range(1, vars(self)["joints"] + 1))
        return tuple(driver.format_map(vars(self)) for driver in self.DRIVERS)

    @property
    def figures(self) -> Mapping[str, float]:
        """Its size in the words of a diagnosis, e.g. `amplitude_rad`; empty when there is no single number."""
        named = (figure.partition("=") for figure in self.FIGURES)
        return {name: float(getattr(self, field or name)) for name, _, field in named}


@dataclass(frozen=True)
class Defect(Mechanism):
    """One hidden mechanism of the chain."""

    SIZE: ClassVar[str] = "share"  # the field that scales it: of what a model has found, all of it
    TYPICAL: ClassVar[float] = 1.0  # a plausible value of that field, in its unit
    INSTRUMENTS: ClassVar[tuple[str, ...]]  # where it can occur
    HABIT: ClassVar[str] = (
        ""  # how a session must be run to show it: "moving", "direct", "payload", "in turns", "" for any
    )
    NEEDS: ClassVar[tuple[str, ...]] = ()  # see `needs`
    ASKED: ClassVar[bool] = False  # drawn only where its name is asked for: seeds of published proofs keep their cases

    @property
    def needs(self) -> tuple[str, ...]:
        """Columns without which nobody could name it; `temp_room_degC`, `approach`, ... (no number: of every joint)."""
        return tuple(column.format_map(vars(self)) for column in self.NEEDS)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        """A plausible one. UnsuitedError when the rig or session has no room for it."""
        raise NotImplementedError(f"{cls.__name__} is a family of mechanisms; draw one of its members")

    @classmethod
    def draw_size(cls, rng: np.random.Generator) -> float:
        """A size between half and twice the typical one."""
        return spread(rng, cls.TYPICAL)

    @classmethod
    def draw_signed(cls, rng: np.random.Generator) -> float:
        """The same with either sign."""
        return cls.draw_size(rng) * float(rng.choice([-1.0, 1.0]))


AnyDefect = TypeVar("AnyDefect", bound=Defect)


def with_size(defect: AnyDefect, size: float) -> AnyDefect:
    """The same mechanism with another size."""
    changed: Any = defect
    return replace(changed, **{defect.SIZE: size})


def size_of(defect: Defect) -> float:
    """The value of the field that scales the mechanism."""
    return float(getattr(defect, defect.SIZE))


@dataclass(frozen=True)
class UnderWeights(Defect):
    """A part that yields to weights that are none of the stated masses, each times its compliance (see `Weight`).

    To the payload, whose mass is known, it yields `payload_rad_nm`.
    """

    weights: tuple[Weight, ...]
    payload_rad_nm: float = 0.0
    share: float = 1.0

    def felt(self, scene: Scene, load: Load, link: int, first: int = 0) -> tuple[Floats, Floats]:
        """Moment about the start of link `link` and force, (row, 3), of the bodies from `first` on and the payload."""
        own = loaded_by(load, [weight for weight in self.weights if weight.body >= first], link)
        payload = carried_by(load, self.payload_rad_nm * scene.payload_kg, scene.payload_com_m, link)
        return own[0] + payload[0], own[1] + payload[1]


# --- an arm in motion


@dataclass(frozen=True, eq=False)
class Shafts:
    """The joints at a moment, each (n,)."""

    q_rad: Floats  # as the controller reads them
    qd_rad_s: Floats
    torque_nm: Floats  # of the drives


@dataclass(frozen=True, eq=False)
class Masses:
    """What the rig states beside its links."""

    rotor_kg_m2: Floats  # (n,) at the joint
    tool_kg: float
    tool_com_m: Vector  # in the flange frame
    gravity_m_s2: Vector  # in the base frame

    @property
    def n_joints(self) -> int:
        return len(self.rotor_kg_m2)


# --- drawing


def direction(rng: np.random.Generator) -> Vector:
    """A unit vector, all directions alike."""
    vector = rng.standard_normal(3)
    return as_vector(vector / np.linalg.norm(vector))


def as_vector(values: NDArray[np.float64]) -> Vector:
    """Three numbers as a tuple."""
    x, y, z = (float(value) for value in values)
    return (x, y, z)


def spread(rng: np.random.Generator, typical: float) -> float:
    """A size between half and twice the typical one, in even steps of its logarithm."""
    return float(typical * 2.0 ** rng.uniform(-1.0, 1.0))


def phase(rng: np.random.Generator) -> float:
    """An angle (rad) in (-pi, pi)."""
    return float(rng.uniform(-np.pi, np.pi))


# --- places in the chain


@runtime_checkable
class ReadsAngle(Protocol):
    """Between the turning shaft and the number that its encoder gives."""

    def reading_error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        """Reading less true angle, (row, n), for shafts that truly stand at `shaft_rad` (row, n)."""
        ...


@runtime_checkable
class TurnsJoint(Protocol):
    """Between the shaft that is read and the joint's output."""

    def extra_turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        """Output less shaft, (row, n)."""
        ...


@runtime_checkable
class RubsAtJoint(Protocol):
    """Against the motion of a joint."""

    def joint_friction_nm(self, shafts: Shafts) -> Floats:
        """(n,) that the drives give more, never against the sign of the speed."""
        ...


@runtime_checkable
class PullsAtJoint(Protocol):
    """Between housing and output of a joint."""

    def joint_pull_nm(self, shafts: Shafts) -> Floats:
        """(n,) that the drives give more."""
        ...


@runtime_checkable
class ChangesMasses(Protocol):
    """What is accelerated and weighs."""

    def true_masses(self, stated: Masses) -> Masses:
        """The true ones."""
        ...


@runtime_checkable
class ReportsTorque(Protocol):
    """Between the torque of a drive and what its controller reports."""

    def reported_torque_nm(self, given_nm: Floats, step_s: float) -> Floats:
        """(step, n) of the torques given, the newest last, `step_s` apart."""
        ...


@runtime_checkable
class MovesLink(Protocol):
    """Between a joint's output and the start of the next joint."""

    @property
    def links(self) -> tuple[int, ...]:
        """Links that move; link i follows joint i, link 0 stands before joint 1."""
        ...

    def link_motion(self, link: int, end_m: Floats, angle_rad: Floats, scene: Scene, load: Load) -> Floats:
        """Motion (row, 4, 4) in the frame that turns with joint `link`, applied to the link's end at `end_m` (3,)."""
        ...


@runtime_checkable
class MovesBase(Protocol):
    """Under the arm."""

    def base_motion(self, scene: Scene, load: Load) -> Floats:
        """Motion (row, 4, 4) of the arm's foot in the base frame."""
        ...


@runtime_checkable
class MovesTool(Protocol):
    """Between flange and laser or target."""

    def tool_motion(self, scene: Scene, load: Load) -> Floats:
        """Motion (row, 4, 4) of the tool in the flange frame."""
        ...


@runtime_checkable
class MovesFixture(Protocol):
    """Under the dual-PSD fixture."""

    def fixture_motion(self, scene: Scene) -> Floats:
        """Motion (row, 4, 4) of the fixture in its own frame."""
        ...


@runtime_checkable
class MovesStations(Protocol):
    """Under all stations of the fixture, or all cones, at once."""

    def stations_motion(self, scene: Scene) -> Floats:
        """Motion (row, 4, 4) in the base frame."""
        ...


@runtime_checkable
class MovesDevice(Protocol):
    """Under the tracker or the wire drum."""

    def device_motion(self, scene: Scene) -> Floats:
        """Motion (row, 4, 4) of the device in its own frame."""
        ...


@runtime_checkable
class MovesSeat(Protocol):
    """Under a cone."""

    def seat_shift_m(self, scene: Scene) -> Floats:
        """(row, 3) in the base frame."""
        ...


@runtime_checkable
class DistortsSpots(Protocol):
    """Between light and what a PSD reads."""

    def seen_spots_m(self, spot_m: Floats, light: Light, scene: Scene) -> Floats:
        """Spots (row, 2, 2) as given when they are truly at `spot_m`."""
        ...


@runtime_checkable
class ChangesSums(Protocol):
    """Light beside the laser's."""

    def seen_sum_v(self, sum_v: Floats, scene: Scene) -> Floats:
        """Sum signals (row, 2) as given."""
        ...


@runtime_checkable
class DistortsPosition(Protocol):
    """Between a target and what a tracker reads."""

    def seen_position_m(self, position_m: Floats, scene: Scene) -> Floats:
        """(row, 3) in the device's frame."""
        ...


@runtime_checkable
class DistortsLength(Protocol):
    """Between a wire and what its drum reads."""

    def seen_length_m(self, length_m: Floats, scene: Scene) -> Floats:
        """(row,)."""
        ...
