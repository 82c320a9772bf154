"""What a drive has to give beside the torque of the links that the rig states, and what it reports of that.

Friction follows F = f(|v|) tanh(v / v0), smooth where the joint turns back (Andersson, Soderberg, Bjorklund, "Friction
models for sliding dry, boundary and mixed lubricated contacts", Tribology International 40, 2007). What it does not
imitate: stiction before the joint slides; a joint that friction holds creeps to its set-point instead.
"""

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from simulators.arm.kinematics import Vector
from simulators.defects.defect import ROBOT, Defect, Floats, Masses, Shafts, as_vector

Size = Annotated[float, msgspec.Meta(ge=0.0, le=1e5)]  # beyond the largest robots, in any of the units here
Signed = Annotated[float, msgspec.Meta(ge=-1e5, le=1e5)]
SENSE_RAD_S = 0.01  # v0: full friction from 0.03 rad/s on, 3 % of the usual speed of a session


@dataclass(frozen=True)
class TorqueDefect(Defect):
    """Of the torque of one joint."""

    joint: int

    PORT = "joint{joint}.torque"
    DRIVERS: ClassVar[tuple[str, ...]] = ("qd{joint}",)
    INSTRUMENTS = ROBOT

    def at_joint(self, value: float, n_joints: int) -> Floats:
        """(n,) with this value at the joint, zero elsewhere."""
        return np.where(np.arange(1, n_joints + 1) == self.joint, value, 0.0)


@dataclass(frozen=True)
class FrictionDefect(TorqueDefect):
    """Friction of one joint; a member gives how much at its speed."""

    def joint_friction_nm(self, shafts: Shafts) -> Floats:
        here = self.joint - 1
        speed_rad_s, torque_nm = float(shafts.qd_rad_s[here]), float(shafts.torque_nm[here])
        return self.at_joint(self.at_speed_nm(speed_rad_s, torque_nm), len(shafts.q_rad))

    def at_speed_nm(self, speed_rad_s: float, torque_nm: float) -> float:
        """Of the same sign as the speed."""
        raise NotImplementedError(f"{type(self).__name__} is a family of mechanisms; take one of its members")


def sense(speed_rad_s: float) -> float:
    """-1 to 1."""
    return float(np.tanh(speed_rad_s / SENSE_RAD_S))


@dataclass(frozen=True)
class Coulomb(FrictionDefect):
    """Dry friction: the same torque at any speed (Coulomb's law)."""

    coulomb_nm: Size

    KIND = "coulomb"
    PHYSICS = "coulomb-friction"
    SIZE = "coulomb_nm"
    FIGURES = ("friction_nm=coulomb_nm",)

    def at_speed_nm(self, speed_rad_s: float, torque_nm: float) -> float:
        return self.coulomb_nm * sense(speed_rad_s)


@dataclass(frozen=True)
class Viscous(FrictionDefect):
    """Grease and oil: friction in proportion to speed."""

    viscous_nms_rad: Size

    KIND = "viscous"
    PHYSICS = "viscous-friction"
    SIZE = "viscous_nms_rad"
    FIGURES = ("friction_nms_per_rad=viscous_nms_rad",)

    def at_speed_nm(self, speed_rad_s: float, torque_nm: float) -> float:
        return self.viscous_nms_rad * speed_rad_s


@dataclass(frozen=True)
class Stribeck(FrictionDefect):
    """More friction at a slow joint: A exp(-(v / vs)^2), beside what is dry and viscous (Andersson et al.)."""

    stribeck_nm: Size
    speed_rad_s: Annotated[float, msgspec.Meta(gt=0.0)]

    KIND = "stribeck"
    PHYSICS = "stribeck-friction"
    SIZE = "stribeck_nm"
    FIGURES = ("friction_nm=stribeck_nm", "speed_rad_s")

    def at_speed_nm(self, speed_rad_s: float, torque_nm: float) -> float:
        return self.stribeck_nm * float(np.exp(-((speed_rad_s / self.speed_rad_s) ** 2))) * sense(speed_rad_s)


@dataclass(frozen=True)
class LoadFriction(FrictionDefect):
    """Teeth that rub by a share of the load L behind them.

    The drive gives T = L + share |L| s, with s from -1 to 1 for the sense of motion; so L = T / (1 + share s sign(T)).
    """

    load_share: Annotated[float, msgspec.Meta(ge=0.0, lt=1.0)]

    KIND = "load-friction"
    PHYSICS = "load-friction"
    DRIVERS = ("qd{joint}", "tau{joint}")
    SIZE = "load_share"
    FIGURES = ("friction_share=load_share",)

    def at_speed_nm(self, speed_rad_s: float, torque_nm: float) -> float:
        rubbed = self.load_share * sense(speed_rad_s)
        return rubbed * abs(torque_nm) / (1.0 + rubbed * float(np.sign(torque_nm)))


# --- what pulls at a joint


@dataclass(frozen=True)
class JointSpring(TorqueDefect):
    """Hose, cables or a balancing spring: k (q - rest), with q as the controller reads it (Hooke's law)."""

    stiffness_nm_rad: Signed
    rest_rad: float

    KIND = "joint-spring"
    PHYSICS = "joint-spring"
    DRIVERS = ("q{joint}",)
    SIZE = "stiffness_nm_rad"
    FIGURES = ("stiffness_nm_per_rad=stiffness_nm_rad",)

    def joint_pull_nm(self, shafts: Shafts) -> Floats:
        off_rad = float(shafts.q_rad[self.joint - 1]) - self.rest_rad
        return self.at_joint(self.stiffness_nm_rad * off_rad, len(shafts.q_rad))


@dataclass(frozen=True)
class GearRipple(TorqueDefect):
    """A torque that rises and falls `order` times a turn of the motor: A sin(order ratio q)."""

    ripple_nm: Size
    order: Annotated[int, msgspec.Meta(ge=1, le=4)]
    ratio: float

    KIND = "gear-ripple"
    PHYSICS = "gear-ripple"
    DRIVERS = ("q{joint}",)
    SIZE = "ripple_nm"
    FIGURES = ("amplitude_nm=ripple_nm",)

    def joint_pull_nm(self, shafts: Shafts) -> Floats:
        turn_rad = self.order * self.ratio * float(shafts.q_rad[self.joint - 1])
        return self.at_joint(self.ripple_nm * float(np.sin(turn_rad)), len(shafts.q_rad))


# --- masses


@dataclass(frozen=True)
class HeavyRotor(TorqueDefect):
    """More inertia of rotor and gear, at the joint: that of the motor times the square of the ratio."""

    inertia_kg_m2: Size

    KIND = "heavy-rotor"
    PHYSICS = "rotor-inertia"
    DRIVERS = ("qdd{joint}",)
    SIZE = "inertia_kg_m2"
    FIGURES = ("inertia_kg_m2",)

    def true_masses(self, stated: Masses) -> Masses:
        return replace(stated, rotor_kg_m2=stated.rotor_kg_m2 + self.at_joint(self.inertia_kg_m2, stated.n_joints))


@dataclass(frozen=True)
class UnstatedPayload(Defect):
    """A mass at the flange, at `com_m` in its frame, that the rig does not state: one rigid body with the tool."""

    mass_kg: Size
    com_m: Vector

    KIND = "unstated-payload"
    PHYSICS = "payload"
    PORT = "tool.load"
    DRIVERS = ("q1",)
    SIZE = "mass_kg"
    INSTRUMENTS = ROBOT
    FIGURES = ("mass_kg",)

    def true_masses(self, stated: Masses) -> Masses:
        whole_kg = stated.tool_kg + self.mass_kg
        moment_kg_m = stated.tool_kg * np.asarray(stated.tool_com_m) + self.mass_kg * np.asarray(self.com_m)
        return replace(stated, tool_kg=whole_kg, tool_com_m=as_vector(moment_kg_m / max(whole_kg, 1e-12)))


@dataclass(frozen=True)
class LeaningGravity(Defect):
    """Gravity, as the base has it, turned by `lean_x_rad` about x, then by `lean_y_rad` about y of the base."""

    lean_x_rad: Signed
    lean_y_rad: Signed

    KIND = "leaning-gravity"
    PHYSICS = "gravity-direction"
    PORT = "base.lean"
    DRIVERS = ("q1",)
    SIZE = "lean_x_rad"
    INSTRUMENTS = ROBOT
    FIGURES = ("lean_x_rad", "lean_y_rad")

    def true_masses(self, stated: Masses) -> Masses:
        turned = Rotation.from_euler("xy", [self.lean_x_rad, self.lean_y_rad]).apply(stated.gravity_m_s2)
        return replace(stated, gravity_m_s2=as_vector(turned))


# --- what is reported


@dataclass(frozen=True)
class WrongTorqueConstant(TorqueDefect):
    """A current that reads by a share more than belongs to its torque: magnets lose strength with heat and age."""

    scale_share: Signed

    KIND = "wrong-torque-constant"
    PHYSICS = "torque-constant"
    DRIVERS = ("tau{joint}",)
    SIZE = "scale_share"
    FIGURES = ("scale_share",)

    def reported_torque_nm(self, given_nm: Floats, step_s: float) -> Floats:
        return given_nm * (1.0 + self.at_joint(self.scale_share, given_nm.shape[1]))


@dataclass(frozen=True)
class TorqueOffset(TorqueDefect):
    """An amplifier whose zero is off, as torque at the joint."""

    offset_nm: Signed

    KIND = "torque-offset"
    PHYSICS = "torque-offset"
    SIZE = "offset_nm"
    FIGURES = ("offset_nm",)

    def reported_torque_nm(self, given_nm: Floats, step_s: float) -> Floats:
        return given_nm + self.at_joint(self.offset_nm, given_nm.shape[1])


@dataclass(frozen=True)
class LateTorque(TorqueDefect):
    """A torque that is reported `late_s` after it was given, between two steps on the straight line."""

    late_s: Annotated[float, msgspec.Meta(ge=0.0, le=0.1)]

    KIND = "late-torque"
    PHYSICS = "torque-delay"
    DRIVERS = ("dtau{joint}",)
    SIZE = "late_s"
    FIGURES = ("delay_s=late_s",)

    def reported_torque_nm(self, given_nm: Floats, step_s: float) -> Floats:
        column, back_s = self.joint - 1, step_s * np.arange(len(given_nm))
        late_nm = given_nm.copy()
        late_nm[:, column] = np.interp(back_s - self.late_s, back_s, given_nm[:, column])
        return late_nm
