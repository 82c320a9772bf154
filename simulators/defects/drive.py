"""Mechanisms between the shaft whose angle is read and the joint's output; also samples taken while it moves."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import Vector, forward
from simulators.arm.statics import Load, weigh
from simulators.defects.defect import ROBOT, Defect, UnderWeights, as_vector, direction, phase
from simulators.defects.scene import Scene, Site, UnsuitedError

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class DriveDefect(Defect):
    """Of the drive of one joint; a member gives by how much its output turns."""

    joint: int

    PORT = "joint{joint}.angle"
    DRIVERS: ClassVar[tuple[str, ...]] = ("q{joint}",)
    INSTRUMENTS = ROBOT

    def turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        """Output less shaft of this joint, (row,), for shafts at `shaft_rad` (row, n)."""
        raise NotImplementedError(type(self).__name__)

    def extra_turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        extra_rad = np.zeros_like(shaft_rad)
        extra_rad[:, self.joint - 1] = self.turn_rad(shaft_rad, scene, load)
        return extra_rad


# --- gears


@dataclass(frozen=True)
class GearRunout(DriveDefect):
    """A pinion `runout_m` off its axis: once per turn of it the output leads and lags, and a little at twice that.

    The pinion of pitch radius r runs e off its axis; the wheel is driven by the place where the teeth meet, so the
    output is off by e sin(N q - b) / R, with N the gear ratio and R the wheel's pitch radius (Munro, "A review of the
    theory and measurement of gear transmission error", IMechE 1990: long-wave part). The second tooth flank adds
    `second` of it at 2 N.
    """

    runout_m: float
    ratio: float
    second: float
    bearing_rad: float
    wheel_radius_m: float = 0.05

    KIND = "gear-runout"
    PHYSICS = "gear-transmission-error"
    SIZE = "runout_m"
    TYPICAL = 2.5e-6  # 50 µrad at 50 mm
    NEEDS = ("gear_ratio",)

    @property
    def figures(self) -> dict[str, float]:
        return {"amplitude_rad": abs(self.runout_m) / self.wheel_radius_m, "order": self.ratio}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        joint = site.geared_joint(rng)
        return cls(joint, cls.draw_size(rng), site.gear_ratio[joint - 1], float(rng.choice([0.0, 0.3])), phase(rng))

    def turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        pinion_rad = self.ratio * shaft_rad[:, self.joint - 1] - self.bearing_rad
        lead_m = self.runout_m * (np.sin(pinion_rad) + self.second * np.sin(2.0 * pinion_rad + 1.0))
        return lead_m / self.wheel_radius_m


@dataclass(frozen=True)
class WrongRatio(DriveDefect):
    """A gear ratio that the controller has wrong: the joint turns `excess` too far in proportion (no unit).

    A friction or belt stage whose wheel diameter is off, or an encoder scale with a missing line: every turn is off
    alike.
    """

    excess: float

    KIND = "wrong-gear-ratio"
    PHYSICS = "gear-ratio-error"
    SIZE = "excess"
    TYPICAL = 1e-4
    FIGURES = ("scale_error_rad_per_rad=excess",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.any_joint(rng), cls.draw_signed(rng))

    def turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        return self.excess * shaft_rad[:, self.joint - 1]


@dataclass(frozen=True)
class CoupledWrist(DriveDefect):
    """A wrist whose drive shafts run through each other: joint `joint` turns by `share` of joint `other` (no unit).

    The concentric shafts of a wrist drive bevel gears; the controller takes the coupling out with a ratio, and what is
    wrong with that ratio remains as a share of the other joint's turn.
    """

    other: int
    share: float

    KIND = "coupled-wrist"
    PHYSICS = "joint-coupling"
    DRIVERS = ("q{other}",)
    TYPICAL = 1e-4
    FIGURES = ("coupling_rad_per_rad=share",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        if not site.gear_ratio or site.n_joints < 6:
            raise UnsuitedError("the arm has no driven wrist")
        joint, other = [(5, 4), (6, 5), (6, 4)][int(rng.integers(3))]
        return cls(joint, other, cls.draw_signed(rng))

    def turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        return self.share * shaft_rad[:, self.other - 1]


# --- play


@dataclass(frozen=True)
class SlackDrive(DriveDefect):
    """Slack of `play_rad` between the flanks: the output trails the motor by half the play, on the side it came from.

    The play operator with the whole history of the motion (see `played`): a move shorter than the play leaves the
    output where it was. Friction holds the output against gravity.
    """

    play_rad: float

    KIND = "slack-drive"
    PHYSICS = "backlash"
    DRIVERS = ("approach{joint}",)
    SIZE = "play_rad"
    TYPICAL = 1e-4
    NEEDS = ("approach",)
    FIGURES = ("play_rad",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.geared_joint(rng), cls.draw_size(rng))

    def turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        column = self.joint - 1
        return played(np.stack((scene.via_rad[:, column], scene.goal_rad[:, column]), axis=1), self.play_rad)


@dataclass(frozen=True)
class SlackUnderWeight(DriveDefect):
    """Slack of `play_rad` in a drive too smooth to hold its load: the output lies on the lower flank.

    Near balance friction of the output (`friction_nm`) holds it between the flanks: the offset goes over from one flank
    to the other in proportion to the torque, min(max(torque / friction, -1), 1).
    """

    play_rad: float
    friction_nm: float

    KIND = "slack-under-weight"
    PHYSICS = "backlash"
    DRIVERS = ("gravity_torque{joint}",)
    SIZE = "play_rad"
    TYPICAL = 2e-4
    FIGURES = ("play_rad",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        if not site.gear_ratio:
            raise UnsuitedError("the arm has no gears")
        return cls(site.loaded_joint(rng), cls.draw_size(rng), float(rng.uniform(0.1, 0.5)))

    def turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        lean = np.clip(load.torque_nm[:, self.joint - 1] / self.friction_nm, -1.0, 1.0)
        return 0.5 * self.play_rad * lean


def played(way: Floats, play: float) -> Floats:
    """Driven less driving side at the end of each row, (row,), with the history of the motion, in the unit of `way`.

    The play operator (Visintin, "Differential Models of Hysteresis", 1994, section III.2): the driven side stays where
    it is until one flank of the driving side meets it, w <- min(max(w, u - b/2), u + b/2). The driving side goes along
    `way` (row, step), row by row; the driven side first stands in the middle.
    """
    half, driven = 0.5 * play, float(way[0, 0])
    behind = np.empty(len(way))
    for row, steps in enumerate(way.tolist()):
        for driving in steps:
            driven = min(max(driven, driving - half), driving + half)
        behind[row] = driven - steps[-1]
    return behind


# --- compliance


@dataclass(frozen=True)
class SoftJoint(DriveDefect):
    """A joint that turns `compliance_rad_nm` per newton metre, like a torsion spring, under the weight beyond it.

    Hooke: turn = torque / stiffness, in the pose that the deflected arm truly takes, with its true masses.
    """

    compliance_rad_nm: float

    KIND = "soft-joint"
    PHYSICS = "joint-compliance"
    DRIVERS = ("gravity_torque{joint}",)
    SIZE = "compliance_rad_nm"
    TYPICAL = 5e-6  # 1 to 10 µrad/Nm: arms of 10 to 200 kg
    FIGURES = ("compliance_rad_nm",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.loaded_joint(rng), cls.draw_size(rng))

    def turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        return self.compliance_rad_nm * load.torque_nm[:, self.joint - 1]


@dataclass(frozen=True)
class TwoSlopeFlexspline(SoftJoint):
    """A strain-wave gear: soft up to `knee_nm` while the flexspline's teeth find their seat, stiffer beyond.

    Harmonic Drive, "Engineering data", torsional stiffness: K1 up to the torque T1, K2 = K1 / `hardening` beyond;
    deflection is T / K1 below and T1 / K1 + (T - T1) / K2 above, the same for both senses.
    """

    hardening: float
    knee_nm: float

    KIND = "two-slope-flexspline"
    TYPICAL = 6e-6
    FIGURES = ("compliance_rad_nm", "knee_nm")

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        joint = site.loaded_joint(rng)
        knee_nm = float(rng.uniform(0.3, 0.7) * site.torque_nm[joint - 1])
        return cls(joint, cls.draw_size(rng), float(rng.uniform(0.3, 0.7)), knee_nm)

    def turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        torque_nm = load.torque_nm[:, self.joint - 1]
        soft_nm = np.clip(torque_nm, -self.knee_nm, self.knee_nm)
        return self.compliance_rad_nm * (soft_nm + self.hardening * (torque_nm - soft_nm))


@dataclass(frozen=True)
class OneSidedSpring(SoftJoint):
    """A drive that is stiffer in one sense: for negative torques it yields `share_back` (no unit) of its compliance.

    One flank of each tooth is worn, or a pair of pinions is preloaded: turn = compliance x torque for positive torques,
    and that share of it for negative ones.
    """

    share_back: float

    KIND = "one-sided-spring"
    TYPICAL = 6e-6

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        both = [joint for joint in site.loaded if 0.2 < site.pushed[joint - 1] < 0.8]
        if not both:
            raise UnsuitedError("gravity turns no joint of this session in both senses")
        return cls(int(rng.choice(both)), cls.draw_size(rng), float(rng.uniform(0.0, 0.4)))

    def turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        torque_nm = load.torque_nm[:, self.joint - 1]
        return self.compliance_rad_nm * np.where(torque_nm > 0.0, torque_nm, self.share_back * torque_nm)


@dataclass(frozen=True)
class WrongLoadCentre(SoftJoint):
    """A soft joint and a payload whose centre of mass is stated `off_m` (flange frame) from where it is."""

    off_m: Vector

    KIND = "wrong-load-centre"
    PHYSICS = "load-centre"
    HABIT = "payload"
    NEEDS = ("payload_kg", "payload_com")
    ALSO = ("joint-compliance",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        off_m = as_vector(rng.uniform(0.08, 0.2) * np.asarray(direction(rng)))
        return cls(site.loaded_joint(rng), cls.draw_size(rng), off_m)

    def stated_columns(self, scene: Scene) -> dict[str, list[float]]:
        """The payload's centre as the recording has it, m."""
        centre_m = np.broadcast_to(scene.payload_com_m + np.asarray(self.off_m), (len(scene), 3))
        return {f"payload_com_{axis}_m": centre_m[:, k].tolist() for k, axis in enumerate("xyz")}


ON_THE_WAY = 8  # loads of each straight move: torque is a smooth function of the angles


@dataclass(frozen=True)
class HystereticSpring(SoftJoint):
    """A drive whose deflection trails its load: strain-wave gears and cycloids under changing torque.

    Prandtl and Ishlinskii's model: turn = compliance x the mean of play operators in the torque, with thresholds of
    `thresholds_nm` (Visintin, "Differential Models of Hysteresis", 1994, section III.2). Each starts in the middle and
    keeps its state through all moves between the samples, from goal to `via_rad` and on to the next goal.
    """

    thresholds_nm: tuple[float, ...]

    KIND = "hysteretic-spring"
    PHYSICS = "load-hysteresis"
    HABIT = "direct"
    ALSO = ("joint-compliance",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        joint = site.loaded_joint(rng)
        thresholds_nm = np.sort(rng.uniform(0.1, 1.2, 3)) * site.torque_nm[joint - 1]
        return cls(joint, cls.draw_size(rng), tuple(float(value) for value in thresholds_nm))

    def turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        way_nm = self._on_the_way_nm(scene, load)
        behind_nm = np.mean([played(way_nm, 2.0 * half_nm) for half_nm in self.thresholds_nm], axis=0)
        return self.compliance_rad_nm * (way_nm[:, -1] + behind_nm)

    def _on_the_way_nm(self, scene: Scene, load: Load) -> Floats:
        """(row, step) torque of gravity on the way to each sample; deflections of 1e-4 rad change none of it."""
        if load.arm is None:
            raise UnsuitedError("the loads between samples are not known in a moving world")
        before_rad = np.concatenate((scene.via_rad[:1], scene.goal_rad[:-1]))
        gone = np.arange(1, ON_THE_WAY + 1)[:, np.newaxis] / ON_THE_WAY
        legs = ((before_rad, scene.via_rad), (scene.via_rad, scene.goal_rad))
        way_rad = np.concatenate([(a + gone[:, np.newaxis] * (b - a)).swapaxes(0, 1) for a, b in legs], axis=1)
        rows, steps, n = way_rad.shape
        frames = forward(load.arm, way_rad.reshape(-1, n) + load.arm.zero_rad)
        ground = np.broadcast_to(np.eye(4), (rows * steps, 4, 4))
        centre_m = np.repeat(np.broadcast_to(scene.payload_com_m, (rows, 3)), steps, axis=0)
        found = weigh(load.arm, frames, ground, np.repeat(scene.payload_kg, steps), centre_m)
        return found.torque_nm[:, self.joint - 1].reshape(rows, steps)


@dataclass(frozen=True)
class PayloadOnSoftJoint(SoftJoint):
    """A soft joint whose controller takes its own weight into account but knows nothing of the payload.

    The drive is a torsion spring; the feed-forward of the arm's own weight winds it back, so only the payload's torque
    is left to turn the output.
    """

    centre_m: Vector | None = None  # the payload's centre of mass in the flange frame; None: as the session has it

    KIND = "payload-on-soft-joint"
    PHYSICS = "payload-compliance"
    DRIVERS = ("payload",)
    TYPICAL = 1e-5
    HABIT = "payload"
    NEEDS = ("payload_kg",)

    def turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        if self.centre_m is None:
            return self.compliance_rad_nm * load.payload_torque_nm[:, self.joint - 1]
        weight_n = scene.payload_kg[:, np.newaxis] * load.gravity_m_s2
        return self.compliance_rad_nm * torque_at_nm(load, self.joint, self.centre_m, weight_n)


def torque_at_nm(load: Load, joint: int, point_m: Vector, force_n: Floats) -> Floats:
    """(row,) about the axis of a joint, of forces (row, 3) in the base frame at a point of the flange."""
    flange, axis = load.frames.flange, load.frames.turning[:, joint - 1]
    lever_m = flange[:, :3, :3] @ np.asarray(point_m) + flange[:, :3, 3] - axis[:, :3, 3]
    return np.einsum("rj,rj->r", np.cross(lever_m, force_n), axis[:, :3, 2])


@dataclass(frozen=True)
class HardeningSpring(DriveDefect):
    """A drive whose stiffness changes smoothly with its load: c T + h T^3 for a torque T.

    A rubber coupling or a strain-wave gear without a marked knee: the first two uneven terms of its characteristic.
    """

    compliance_rad_nm: float
    hardening_rad_nm3: float

    KIND = "hardening-spring"
    PHYSICS = "joint-compliance"
    DRIVERS = ("gravity_torque{joint}",)
    SIZE = "compliance_rad_nm"
    TYPICAL = 5e-6

    def turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        torque_nm = load.torque_nm[:, self.joint - 1]
        return self.compliance_rad_nm * torque_nm + self.hardening_rad_nm3 * torque_nm**3


@dataclass(frozen=True)
class SpringUnderWeights(UnderWeights, DriveDefect):
    """A soft joint under other weights than the stated masses."""

    KIND = "spring-under-weights"
    PHYSICS = "joint-compliance"
    DRIVERS = ("gravity_torque{joint}",)

    def turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        moment, _ = self.felt(scene, load, self.joint)
        return self.share * moment[:, 2]


@dataclass(frozen=True)
class PressedJoint(DriveDefect):
    """A joint of a measuring arm that gives way to the hand, which presses the probe along steady axes of the tool.

    Torsion spring of `compliance_rad_nm` under the torque of `force_n`, a force in the flange frame at `point_m`.
    """

    compliance_rad_nm: float
    force_n: Vector
    point_m: Vector

    KIND = "pressed-joint"
    PHYSICS = "joint-compliance"
    DRIVERS = ("q{joint}",)
    SIZE = "compliance_rad_nm"
    TYPICAL = 5e-6
    INSTRUMENTS = ("seat",)

    def turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        force_n = load.frames.flange[:, :3, :3] @ np.asarray(self.force_n)
        return self.compliance_rad_nm * torque_at_nm(load, self.joint, self.point_m, force_n)


# --- all drives still on their way


@dataclass(frozen=True)
class Unsettled(Defect):
    """Samples taken before the arm stands: `left` of the last move is still to go (no unit).

    Every joint still creeps towards its goal, which is what the controller reports. First-order settling (a position
    loop without integrator): what is left of the move after `wait` is exp(-wait / T). The field is that rest; it is the
    same for all joints and all moves, as the program waits the same time after each.
    """

    left: float
    joints: int

    KIND = "unsettled"
    PHYSICS = "not-settled"
    PORT = "time"
    EVERY_JOINT = "last_move"
    SIZE = "left"
    TYPICAL = 1e-5
    INSTRUMENTS = ROBOT
    HABIT = "direct"
    FIGURES = ("left_share=left",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(cls.draw_size(rng), site.n_joints)

    def extra_turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        return -self.left * scene.last_move_rad


@dataclass(frozen=True)
class LateClock(Defect):
    """Clocks that disagree: the instrument reads `late_s` after the encoders, while the arm moves on."""

    late_s: float
    joints: int

    KIND = "late-clock"
    PHYSICS = "latency"
    PORT = "time"
    EVERY_JOINT = "qd"
    SIZE = "late_s"
    TYPICAL = 2e-3
    INSTRUMENTS = ROBOT
    HABIT = "moving"
    NEEDS = ("qd",)
    FIGURES = ("delay_s=late_s",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(cls.draw_signed(rng), site.n_joints)

    def extra_turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        return self.late_s * scene.qd_rad_s
