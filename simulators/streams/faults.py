"""What is wrong with a motion or with the streams that record it.

A fault is a frozen record; it takes hold by having one or more of the methods of the protocols below. A new one is a
class here and a name in `FAULTS`.
"""

from dataclasses import dataclass
from typing import Protocol, Self, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from simulators.arm.kinematics import Vector
from simulators.defects.defect import Mechanism, direction, spread
from simulators.streams.course import STEP_S, Course, swung

Floats = NDArray[np.float64]
SETTLED_S = 0.06  # after a stop, from which the size of a swing counts


@dataclass(frozen=True)
class StreamFault(Mechanism):
    """One hidden fault; `PHYSICS` as in docs/formats.md, findings in streams."""

    @property
    def size(self) -> float:
        """Over the noise of one reading of the stream that shows it."""
        raise NotImplementedError(type(self).__name__)

    @classmethod
    def draw(cls, rng: np.random.Generator, n_joints: int) -> Self:
        raise NotImplementedError(f"{cls.__name__} is no fault of its own; draw one of FAULTS")


@runtime_checkable
class StampsLate(Protocol):
    """Between reading and stamp of a device."""

    def late_s(self, device: str) -> float: ...


@runtime_checkable
class ReadsEncoders(Protocol):
    """Between shafts and the second set of encoders."""

    def read_rad(self, course: Course, q_rad: Floats) -> Floats:
        """(step, n) as they are read, of what (step, n) they turn."""
        ...


@runtime_checkable
class MovesOutput(Protocol):
    """Between shafts and what the joints carry."""

    def left_rad(self, course: Course) -> Floats:
        """(step, n) that the outputs are behind the shafts."""
        ...


@runtime_checkable
class SwaysBase(Protocol):
    """Under the arm."""

    def sway_rad(self, course: Course) -> Floats:
        """(step, 3) rotation vector of the foot."""
        ...


@runtime_checkable
class HurriesReading(Protocol):
    """When the samples are taken."""

    def wait_s(self) -> float:
        """From a stop to the first reading."""
        ...


@dataclass(frozen=True)
class LateStamps(StreamFault):
    """Encoders that read, wait `by_s` and then stamp: an interrupt that is served late, a queue on the bus."""

    by_s: float
    joints: int

    KIND = "stream-late-stamps"
    PHYSICS = "latency"
    PORT = "time"
    EVERY_JOINT = "qd"
    FIGURES = ("latency_s=by_s",)

    @property
    def size(self) -> float:
        return self.by_s / 2e-4  # of what a line usually delays

    @classmethod
    def draw(cls, rng: np.random.Generator, n_joints: int) -> Self:
        return cls(spread(rng, 3e-3), n_joints)

    def late_s(self, device: str) -> float:
        return self.by_s if device == "encoders" else 0.0


@dataclass(frozen=True)
class LaggingEncoder(StreamFault):
    """Encoder behind a filter of its own: a first-order lag of `time_constant_s` between shaft and reading."""

    joint: int
    time_constant_s: float

    KIND = "stream-lagging-encoder"
    PHYSICS = "reading-lag"
    PORT = "joint{joint}.angle"
    DRIVERS = ("qd{joint}",)
    FIGURES = ("behind_s=time_constant_s",)

    @property
    def size(self) -> float:
        return self.time_constant_s * 0.5 / 6e-6  # at a usual speed, over an encoder's noise

    @classmethod
    def draw(cls, rng: np.random.Generator, n_joints: int) -> Self:
        return cls(int(rng.integers(1, n_joints + 1)), spread(rng, 3e-3))

    def read_rad(self, course: Course, q_rad: Floats) -> Floats:
        read = q_rad.copy()
        own_rad, keep = q_rad[:, self.joint - 1], float(np.exp(-STEP_S / self.time_constant_s))
        read[:, self.joint - 1] = own_rad[0] + lfilter([0.0, 1.0 - keep], [1.0, -keep], own_rad - own_rad[0])
        return read


@dataclass(frozen=True)
class SlippingEncoder(StreamFault):
    """Encoder whose coupling slips once, on its way: it reads `slip_rad` more after `share` of the session."""

    joint: int
    slip_rad: float
    share: float

    KIND = "stream-slipping-encoder"
    PHYSICS = "encoder-slip"
    PORT = "joint{joint}.angle"
    DRIVERS = ("t",)
    FIGURES = ("slip_rad",)

    @property
    def size(self) -> float:
        return abs(self.slip_rad) / 6e-6

    @classmethod
    def draw(cls, rng: np.random.Generator, n_joints: int) -> Self:
        slip_rad = spread(rng, 1.5e-4) * float(rng.choice([-1.0, 1.0]))
        return cls(int(rng.integers(1, n_joints + 1)), slip_rad, float(rng.uniform(0.25, 0.75)))

    def read_rad(self, course: Course, q_rad: Floats) -> Floats:
        read = q_rad.copy()
        read[:, self.joint - 1] += np.where(course.time_s >= self.share * course.time_s[-1], self.slip_rad, 0.0)
        return read


@dataclass(frozen=True)
class EarlyReading(StreamFault):
    """Samples taken before the arm stands: the outputs creep to their goal, and the program does not wait for it.

    `left` of each move is still to go at its stop, with one time constant; read `after_s`.
    """

    left: float
    time_constant_s: float
    after_s: float
    joints: int

    KIND = "stream-early-reading"
    PHYSICS = "not-settled"
    PORT = "time"
    EVERY_JOINT = "last_move"
    FIGURES = ("tau_s=time_constant_s",)

    @property
    def size(self) -> float:
        return self.left * float(np.exp(-self.after_s / self.time_constant_s)) * 0.5 / 2e-6  # of half a metre

    @classmethod
    def draw(cls, rng: np.random.Generator, n_joints: int) -> Self:
        return cls(
            float(np.exp(rng.uniform(np.log(2e-5), np.log(4e-4)))),
            float(rng.uniform(0.06, 0.15)),
            float(rng.uniform(0.02, 0.1)),
            n_joints,
        )

    def left_rad(self, course: Course) -> Floats:
        last, since_s = course.since_stop()
        stops = np.searchsorted(course.time_s, course.stops_s)
        goal_rad = course.command_rad[np.minimum(stops, len(course.command_rad) - 1)]
        moved_rad = np.diff(goal_rad, axis=0, prepend=goal_rad[:1])
        standing = np.all(np.abs(course.command_rad - goal_rad[last]) < 1e-9, axis=1)
        fading = self.left * np.exp(-since_s / self.time_constant_s)
        # on the way the outputs are as far behind as at the next stop: that a move is one motion needs no more
        next_move = moved_rad[np.minimum(last + 1, len(moved_rad) - 1)]
        return np.where(standing[:, np.newaxis], fading[:, np.newaxis] * moved_rad[last], self.left * next_move)

    def wait_s(self) -> float:
        return self.after_s


@dataclass(frozen=True)
class SwingingFoot(StreamFault):
    """Foot on a spring: the arm's braking sets it swinging, by `turn_rad` rms just after the stops.

    x'' + 2 z w x' + w^2 x = -a (a mass on a spring that is shaken; any text on vibration).
    """

    frequency_hz: float
    damping: float
    turn_rad: float
    about: Vector

    KIND = "stream-swinging-foot"
    PHYSICS = "ringing"
    PORT = "base.pose"
    DRIVERS = ("t",)
    FIGURES = ("frequency_hz", "damping_share=damping")

    @property
    def size(self) -> float:
        return self.turn_rad * 0.5 / 2e-6

    @classmethod
    def draw(cls, rng: np.random.Generator, n_joints: int) -> Self:
        return cls(
            float(rng.uniform(6.0, 16.0)),
            float(rng.uniform(0.02, 0.06)),
            float(np.exp(rng.uniform(np.log(1.5e-5), np.log(1e-4)))),
            direction(rng),
        )

    def sway_rad(self, course: Course) -> Floats:
        shaken = np.gradient(np.gradient(course.q_rad[:, :3].sum(axis=1), STEP_S), STEP_S)
        swing = swung(shaken[:, np.newaxis], self.frequency_hz, self.damping)[:, 0]
        after = np.interp(course.stops_s[1:] + SETTLED_S, course.time_s, swing)
        scale = self.turn_rad / max(float(np.sqrt(np.mean(after**2))), 1e-300)
        return scale * swing[:, np.newaxis] * np.asarray(self.about)


FAULTS: tuple[type[StreamFault], ...] = (LateStamps, LaggingEncoder, SlippingEncoder, EarlyReading, SwingingFoot)
