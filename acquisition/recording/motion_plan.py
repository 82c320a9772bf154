"""A periodic motion of all joints, `motion.toml`: written by `excite`, run by a session (docs/formats.md).

q(t) = middle + sum over k of sine_k sin(2 pi k t / length) + cosine_k cos(2 pi k t / length), k from 1: a finite
Fourier series for each joint. Source: Swevers et al., Optimal robot excitation and identification, IEEE Trans. Robotics
and Automation 13(5), 1997. Where the sums of k sine_k and of k^2 cosine_k are 0, every repeat begins and ends at rest,
and without acceleration.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from acquisition.recording.errors import RigFileError, shown
from acquisition.recording.files.bounds import Few, Many, Name, PerJoint, Radians, Sentence
from acquisition.recording.files.explain import KeyPath
from acquisition.recording.files.toml_file import parse_toml, read_text
from acquisition.recording.output import toml_output, write_output
from acquisition.recording.rig import Rig

Floats = NDArray[np.float64]
Length = Annotated[float, Meta(ge=1.0, le=3600.0)]  # s; a motion of an hour is as long as the gate takes
Repeats = Annotated[int, Meta(ge=1, le=1000)]

MOTION_EVENT = "motion"  # with length_s, repeats, and host_s when the set-points were at motion_s (s, from its begin)
MOTION_PLAN = toml_output(("schema", "rig", "length_s", "repeats", "joint"), "motion plan")
REST_RAD_S, REST_RAD_S2 = 1e-4, 1e-3  # speed and acceleration at which a joint is at rest: coefficients have digits
CHECKED = 4000  # moments of a repeat whose angles are compared with the ranges of the joints


class JointSeries(Struct, frozen=True, forbid_unknown_fields=True):
    """Of one joint; sine_rad and cosine_rad are amplitudes of one, two, three ... cycles a repeat."""

    middle_rad: Radians
    sine_rad: Few[Radians]
    cosine_rad: Few[Radians]


class MotionPlan(Struct, frozen=True, forbid_unknown_fields=True):
    """A whole motion. All joints have series of the same length."""

    schema: Literal[1]
    rig: Name
    length_s: Length  # of one repeat
    repeats: Repeats
    joint: PerJoint[JointSeries]
    purpose: Many[Sentence] = ()  # one line for a person each

    @property
    def total_s(self) -> float:
        return self.length_s * self.repeats

    def at(self, t_s: Floats, derivative: int = 0) -> Floats:
        """(moment, joint) readings in rad at times (moment,), or a derivative of them by time, in rad/s^derivative."""
        sine, cosine = (np.array([getattr(j, f"{name}_rad") for j in self.joint]) for name in ("sine", "cosine"))
        w = 2.0 * np.pi / self.length_s * np.arange(1, sine.shape[1] + 1)
        phase = np.multiply.outer(t_s, w) + 0.5 * np.pi * derivative
        out: Floats = (w**derivative * np.sin(phase)) @ sine.T + (w**derivative * np.cos(phase)) @ cosine.T
        return out + np.array([j.middle_rad for j in self.joint]) if derivative == 0 else out


def read_motion_plan(path: Path, rig: Rig) -> MotionPlan:
    """The motion of a file, checked against the rig. RigFileError naming file, line, key, value and remedy."""
    file = parse_toml(read_text(path, "motion plan", RigFileError), str(path), RigFileError)
    plan = file.checked(MotionPlan)
    for place, says in _contradictions(plan, rig):
        raise file.error(place, says)
    return plan


def write_motion_plan(path: Path, plan: MotionPlan) -> None:
    """Write the file. OutputError, OSError as `write_output`."""
    write_output(path, "\n".join(_lines(plan)) + "\n", MOTION_PLAN)


def no_torque(rig: Rig) -> str:
    """Why the currents of this rig's robot are no torques; empty where they are."""
    if any(joint.torque_per_ampere for joint in rig.arm.joints):
        return ""
    return "no joint has a torque_per_ampere in the rig file: currents are recorded, and no torques can be made of them"


def _contradictions(plan: MotionPlan, rig: Rig) -> Iterator[tuple[KeyPath, str]]:
    if plan.rig != rig.name:
        yield (
            ("rig",),
            f"rig = '{shown(plan.rig, 60)}', but this rig is '{shown(rig.name, 60)}'; give the motion of this rig",
        )
    if len(plan.joint) != rig.n_joints:
        yield ("joint",), f"{len(plan.joint)} [[joint]], but the arm has {rig.n_joints} joints; give one a joint"
        return
    count = len(plan.joint[0].sine_rad)
    for i, joint in enumerate(plan.joint):
        for name in ("sine_rad", "cosine_rad"):
            if len(getattr(joint, name)) != count or count == 0:
                yield (
                    ("joint", i, name),
                    f"{name} of joint {i + 1} has {len(getattr(joint, name))} amplitudes, sine_rad of joint 1 has "
                    f"{count}; give as many of both to every joint, at least one",
                )
                return
    yield from _unfit(plan, rig)


def _unfit(plan: MotionPlan, rig: Rig) -> Iterator[tuple[KeyPath, str]]:
    """Joints that do not begin at rest, or leave their range."""
    begin, times_s = np.zeros(1), np.linspace(0.0, plan.length_s, CHECKED)
    speed, acceleration, q_rad = plan.at(begin, 1)[0], plan.at(begin, 2)[0], plan.at(times_s)
    for i, limits in enumerate(rig.arm.joints):
        if abs(speed[i]) > REST_RAD_S:
            yield (
                ("joint", i, "sine_rad"),
                f"joint {i + 1} begins with {speed[i]:.4g} rad/s; choose sine_rad so that the sum of k times the k-th "
                "amplitude is 0",
            )
        if abs(acceleration[i]) > REST_RAD_S2:
            yield (
                ("joint", i, "cosine_rad"),
                f"joint {i + 1} begins with {acceleration[i]:.4g} rad/s2; choose cosine_rad so that the sum of k "
                "squared times the k-th amplitude is 0",
            )
        outside = np.flatnonzero((q_rad[:, i] < limits.lower_rad) | (q_rad[:, i] > limits.upper_rad))
        if outside.size:
            yield (
                ("joint", i),
                f"joint {i + 1} at {q_rad[outside[0], i]:.4g} rad at {times_s[outside[0]]:.2f} s is outside its range "
                f"{limits.lower_rad:g} ... {limits.upper_rad:g}; move its middle_rad, or take smaller amplitudes",
            )


def _lines(plan: MotionPlan) -> Iterator[str]:
    yield f"schema = {plan.schema}"
    yield f"rig = {msgspec.json.encode(plan.rig).decode()}"
    yield f"length_s = {plan.length_s!r}  # of one repeat"
    yield f"repeats = {plan.repeats}"
    yield "purpose = ["
    yield from (f"  {msgspec.json.encode(line).decode()}," for line in plan.purpose)
    yield "]"
    for i, joint in enumerate(plan.joint, start=1):
        yield f"\n[[joint]]  # {i}"
        yield f"middle_rad = {joint.middle_rad!r}"
        for name in ("sine_rad", "cosine_rad"):
            yield f"{name} = [{', '.join(map(repr, getattr(joint, name)))}]"
