"""What a torque may depend on, one value a moment of a motion; and the form of a term at one joint's torque."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Form, Functions, Inner, Shape

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
TURNING = 0.3  # of the speed below which a joint is taken to stand: from there on friction has all its size
Law = Callable[["MotionDrivers", Floats, int], Floats]  # (moment, m) for inner values (inner,), at a joint from 1


@dataclass(frozen=True, eq=False)
class Samples:
    """What was read between the moments: what changes within a moment is made of all samples, and passes the low pass
    that their torques have passed.
    """

    q_rad: Floats  # (sample, joint)
    qd_rad_s: Floats  # (sample, joint)
    rows: Ints  # (moment,) sample of each
    cuts: tuple[int, ...]  # first samples of all runs without gap but the first
    low_pass: Callable[[Floats], Floats]  # of (sample, m)

    @classmethod
    def as_planned(cls, q_rad: Floats, qd_rad_s: Floats) -> "Samples":
        """Moments of a plan, that pass no filter."""
        return cls(q_rad, qd_rad_s, np.arange(len(q_rad)), (), lambda values: values)

    def passed(self, values: Floats) -> Floats:
        """(moment, m) of values (sample, m)."""
        runs = np.split(values, self.cuts)
        return np.concatenate([self.low_pass(run) for run in runs])[self.rows]


@dataclass(frozen=True, eq=False, kw_only=True)
class MotionDrivers(Drivers):
    """Joint angles and speeds are smoothed; torque is that of the rigid links as fitted, never the measured one."""

    qd: Floats  # (moment, joint) rad/s
    qdd_rad_s2: Floats  # (moment, joint)
    torque_nm: Floats  # (moment, joint) of the rigid links
    torque_rate_nm_s: Floats  # (moment, joint) its derivative by time
    link_columns: Floats  # (moment * joint, link number) torque for one unit of each number of each link
    rate_columns: Floats  # (moment * joint, link number) the same of its derivative by time
    lean_columns: Floats  # (moment * joint * 2, link number) its change for one radian that gravity leans about x, y
    last_link: Floats  # (moment, joint, 10) torque for one unit of each number of what the flange carries
    tilted: Floats  # (moment, joint, 2) torque for one radian by which gravity leans about x, y of the base
    samples: Samples
    still_rad_s: Floats  # (joint,) below this speed it is open which way a joint turns
    middle_rad: Floats  # (joint,) what the way of a spring is counted from
    temperature_degC: Floats | None = None  # (moment, joint)
    reference_degC: Floats | None = None  # (joint,) what friction by temperature is counted from
    begin_s: float  # of the whole motion: what running-in is counted from
    known: bool = False  # terms are those of a model: also such as this motion alone would not show

    @property
    def clock_is_a_cause(self) -> bool:
        return False

    @cached_property
    def senses(self) -> Floats:
        """(moment, joint) which way each joint turns, behind the low pass; nought while it stands."""
        return self.samples.passed(self._senses)

    @cached_property
    def _senses(self) -> Floats:
        """(sample, joint) before it."""
        return np.clip(self.samples.qd_rad_s / (TURNING * self.still_rad_s), -1.0, 1.0)

    def moved_on(self, by_s: float) -> "MotionDrivers":
        """So much later: angles, speeds and torques at their rates, the sense of motion as it is."""
        samples = replace(self.samples, q_rad=self.samples.q_rad + by_s * self.samples.qd_rad_s)
        q_rad, qd = self.q_rad + by_s * self.qd, self.qd + by_s * self.qdd_rad_s2
        torque_nm = self.torque_nm + by_s * self.torque_rate_nm_s
        return replace(self, samples=samples, q_rad=q_rad, qd=qd, torque_nm=torque_nm)

    def sense(self, joint: int) -> Floats:
        """(moment,) of a joint, from 1."""
        return self.senses[:, joint - 1]

    def sense_by_speed(self, joint: int, law: Callable[[Floats], Floats]) -> Floats:
        """(moment,) of a joint, from 1, times a law of its speed, behind the low pass."""
        here = slice(joint - 1, joint)
        return self.samples.passed(self._senses[:, here] * law(self.samples.qd_rad_s[:, here]))[:, 0]


def torque_port(joint: int) -> Port:
    """Of the torque of a joint, from 1."""
    return Port(f"joint{joint}.torque", Place.JOINTS)


def at_joints(
    drivers: Drivers,
    physics: str,
    shape: Shape,
    depends_on: tuple[str, ...],
    law: Law,
    names: tuple[str, ...],
    limit: float,
    sentence: str,
    *,
    among: Sequence[int] | None = None,
    inner: tuple[Inner, ...] = (),
    order: int | None = None,
    positive: bool = False,
    polar: bool = False,
    reversed_sentence: str = "",
    slow: bool = False,
    variant: str = "",
    open_: bool = False,
) -> tuple[Form, ...]:
    """A term at the torque of every joint, or of those `among` them, from 1; {joint} stands for its number.

    `positive`: no machine has it with the other sign; `open_`: it stands for what no entry of the catalogue describes.
    """
    return tuple(
        Form(
            torque_port(i),
            tuple(name.replace("{joint}", str(i)) for name in depends_on),
            shape,
            physics,
            order,
            inner,
            slow=slow,
            variant=variant,
            open=open_,
            function=_of_motion(law, i),
            names=names,
            limit=limit,
            sentence=sentence.replace("{joint}", str(i)),
            reversed_sentence=reversed_sentence.replace("{joint}", str(i)),
            directions=np.eye(drivers.n_joints)[:, i - 1 : i],
            polar=polar,
            believable=(lambda values, inner: bool(values[0] > 0.0)) if positive else None,
        )
        for i in (joints(drivers) if among is None else among)
    )


def _of_motion(law: Law, joint: int) -> Functions:
    def function(drivers: Drivers, inner: Floats) -> Floats:
        if not isinstance(drivers, MotionDrivers):
            raise TypeError("a torque without a motion")
        return law(drivers, inner, joint)

    return function


def joints(drivers: Drivers) -> range:
    """Numbers of the joints, from 1."""
    return range(1, drivers.n_joints + 1)
