"""The moving arm: MuJoCo, servo, reference and repeatability joined, one physics step at a time.

When everything stands (reference arrived, gears seated, error and speed below what double precision can still
change) the state is frozen: stepping on would move no joint by more than 1e-12 rad.

The set-point between two commands: a straight line over one controller cycle, no faster than a joint can turn.

A controller commands once per cycle and its joints interpolate in between, so the reference trails the set-point by
one cycle and its speed is known to the servo. A jump becomes a ramp at top speed.

Joint repeatability: after every motion the output of a gear stands a little off what the motor side has.

Mechanism: when a gear turns, teeth and rolling elements seat again, so the output comes to rest N(0, sigma) away from
the motor-side angle, and stays there as long as nothing moves. A motion begins when the set-point changes after
standing; then the next offset is drawn and taken up along a smooth curve of SEATING_S, so that no step is seen. A
motion has ended when the set-point has not changed for SEATING_S: every curve is finished by then.

What it does not imitate: dependence on direction, load or distance (that is backlash, another mechanism).
"""

import math
from collections import deque
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from simulators.defects.defect import Shafts
from simulators.world.model import STEP_S, STEPS_PER_COMMAND, build_mjcf, torque_limits_nm
from simulators.world.moving_mechanisms import Exposure, MovingMechanisms
from simulators.world.optics import Ray
from simulators.world.rig import WorldRig
from simulators.world.servo import STIFFNESS, Engine, Servo
from simulators.world.torque_mechanisms import TorqueMechanisms, mean_of_cycles
from simulators.world.truth import Truth

Floats = NDArray[np.float64]
TOP_SPEED_RAD_S = math.pi  # 180 deg/s: UR5e technical details, every joint


class Reference:
    """Where each joint shall be now, in the controller's own readings."""

    def __init__(self, q_rad: Floats) -> None:
        self.q_rad: Floats = q_rad.copy()
        self.qd_rad_s: Floats = np.zeros_like(q_rad)
        self.goal_rad: Floats = q_rad.copy()
        self.arrived = True
        self._stride_rad: Floats = np.zeros_like(q_rad)

    def aim(self, goal_rad: Floats) -> bool:
        """A new set-point (n,); False when it is the present one, which changes nothing."""
        if not np.count_nonzero(goal_rad != self.goal_rad):
            return False
        self.goal_rad = goal_rad.copy()
        per_step_rad = np.abs(goal_rad - self.q_rad) / STEPS_PER_COMMAND
        self._stride_rad = np.minimum(per_step_rad, TOP_SPEED_RAD_S * STEP_S)
        self.arrived = False
        return True

    def step(self) -> None:
        """Advance by one physics step."""
        if self.arrived:
            return
        left_rad = self.goal_rad - self.q_rad
        move_rad = np.minimum(np.maximum(left_rad, -self._stride_rad), self._stride_rad)
        self.q_rad = self.q_rad + move_rad
        self.qd_rad_s = move_rad / STEP_S
        if not np.count_nonzero(move_rad):
            self.q_rad = self.goal_rad.copy()
            self.arrived = True


SEATING_S = 0.050  # about the settling time of a UR joint; shorter would shake the arm, longer outlast a small motion


class Repeatability:
    """How far each true joint stands off its reading, (n,) rad; stepped with the physics."""

    def __init__(self, sigma_rad: float, n_joints: int, rng: np.random.Generator) -> None:
        self._sigma_rad = sigma_rad
        self._rng = rng
        self._steps_of_curve = math.ceil(SEATING_S / STEP_S - 1e-9)
        self._step_of_curve = self._steps_of_curve
        self._steps_unchanged = self._steps_of_curve
        self._from_rad: Floats = np.zeros(n_joints)
        self._to_rad: Floats = self._draw()
        self.offset_rad: Floats = self._to_rad

    @property
    def seated(self) -> bool:
        """True when the offsets stay what they are until the next motion."""
        return self._step_of_curve >= self._steps_of_curve and self._steps_unchanged >= self._steps_of_curve

    def setpoint_changed(self) -> None:
        """The controller asked for another position; after standing this begins a motion."""
        if self._steps_unchanged >= self._steps_of_curve:
            self._from_rad, self._to_rad = self._to_rad, self._draw()
            self._step_of_curve = 0
        self._steps_unchanged = 0

    def step(self, moving: bool) -> None:
        """Advance by one physics step; `moving`: the reference has not arrived at the set-point yet."""
        self._steps_unchanged = 0 if moving else self._steps_unchanged + 1
        if self._step_of_curve >= self._steps_of_curve:
            return
        self._step_of_curve += 1
        done = self._step_of_curve / self._steps_of_curve
        share = done * done * (3.0 - 2.0 * done)  # smoothstep: starts and ends without speed
        self.offset_rad = self._from_rad + share * (self._to_rad - self._from_rad)
        if self._step_of_curve == self._steps_of_curve:
            self.offset_rad = self._to_rad

    def _draw(self) -> Floats:
        return self._sigma_rad * self._rng.standard_normal(len(self._from_rad))


STANDS_RAD = 1e-13
WAKES_RAD = 1e-11  # by which a mechanism has moved the reading of a standing joint: the servo takes it up
STANDS_RAD_S = 1e-11  # dies out within about 1/150 s of the servo, so less than 1e-13 rad is still to come


class ArmBody:
    """Owns the physics state. Joint vectors are (n,), in joint order."""

    def __init__(
        self,
        rig: WorldRig,
        truth: Truth,
        q_rad: Floats,
        rng: np.random.Generator,
        hidden: MovingMechanisms | None = None,
        rest_degC: Mapping[str, float] | None = None,
        torques: TorqueMechanisms | None = None,
        stated: WorldRig | None = None,
    ) -> None:
        """`stated`: the rig as its controller has it, where `rig` has other masses."""
        n = len(truth.links)
        self._hidden, self._exposure = hidden, Exposure(q_rad, rest_degC)
        self._torques = torques
        self._engine = Engine(build_mjcf(rig, truth))
        self._stated = self._engine if stated is None else Engine(build_mjcf(stated, truth))
        self._at, self._driven = self._engine.joint_addresses([f"joint{number}" for number in range(1, n + 1)])
        self._laser_origin, self._laser_axes = self._engine.site("laser")
        self._turning = [self._engine.body(f"axis{number}") for number in range(1, n + 1)]
        self._zero_rad: Floats = np.array(truth.joint_zero_rad)
        self._reference = Reference(q_rad)
        self._repeatability = Repeatability(rig.emulation.joint_repeatability_rad, n, rng)
        limits = stated or rig
        self._servo = Servo(self._engine, self._driven, np.array(torque_limits_nm(limits.arm, limits.tool)))
        self._engine.qpos[self._at] = q_rad + self._offset_rad()
        self._engine.refresh()
        self._servo.drive(np.zeros(n), np.zeros(n))
        self._given_nm: deque[Floats] = deque([self._servo.torque_nm], maxlen=STEPS_PER_COMMAND)
        if torques is not None:
            torques.given(self._servo.torque_nm)
        self.stands = torques is None or not torques.acting

    def aim(self, q_rad: Floats, time_s: float) -> None:
        """A new set-point, in the controller's own readings."""
        if self._reference.aim(q_rad):
            self._exposure.commanded(q_rad, time_s)
            self._repeatability.setpoint_changed()
            self.stands = False

    def step(self) -> None:
        """One physics step; afterwards all poses are those of the new joint angles."""
        if self.stands:
            return
        self._reference.step()
        self._repeatability.step(moving=not self._reference.arrived)
        error_rad = self._reference.q_rad + self._offset_rad() - self.true_rad()
        error_rad_s = self._reference.qd_rad_s - self.speed_rad_s()
        self._servo.drive(error_rad, error_rad_s)
        self._given_nm.append(self._servo.torque_nm)
        if self._torques is not None:
            self._load_joints(self._torques)
        self._engine.step()
        if self._reference.arrived and self._repeatability.seated:
            self.stands = self._at_rest(error_rad)

    def feel(self, time_s: float, placement: int) -> None:
        """What hidden mechanisms do from now on; held until the next call."""
        if self._hidden is None:
            return
        before_rad = self._hidden.turn_rad
        own_rad = self._zero_rad + self._repeatability.offset_rad
        scene = self._exposure.scene(time_s, self._reference.qd_rad_s, placement)
        turning = np.stack([_pose(*frame) for frame in self._turning])
        self._hidden.felt(scene, self.true_rad(), own_rad, turning, self._stiff_flange())
        if np.abs(self._hidden.turn_rad - before_rad).max() > WAKES_RAD:
            self.stands = False

    def _load_joints(self, torques: TorqueMechanisms) -> None:
        """Takes what the drives have to give beside the links from what moves them."""
        torques.given(self._servo.torque_nm)
        if torques.acting:
            shafts = Shafts(self.reading_rad(), self.speed_rad_s(), self._servo.torque_nm)
            friction_nm, pull_nm = torques.felt_nm(shafts)
            self._engine.applied[self._driven] -= pull_nm
            self._engine.rub(self._driven, friction_nm)

    def _at_rest(self, error_rad: Floats) -> bool:
        """Every joint of the model, driven or not, has come to rest; one that a spring pulls keeps its error."""
        if self._torques is not None:
            if not self._torques.settled:
                return False
            if self._torques.acting:
                error_rad = self._engine.qacc / STIFFNESS
        return bool(np.abs(error_rad).max() < STANDS_RAD and np.abs(self._engine.qvel).max() < STANDS_RAD_S)

    def true_rad(self) -> Floats:
        """True joint angles, as an ideal encoder at the link would see them."""
        return self._engine.qpos[self._at]

    def reading_rad(self) -> Floats:
        """What the controller's own sensors see: the truth less zero, repeatability and what is hidden."""
        return self.true_rad() - self._offset_rad()

    def speed_rad_s(self) -> Floats:
        return self._engine.qvel[self._driven]

    def torque_nm(self) -> Floats:
        """As the drives report them, in the mean of the last cycle: 1.5 ms older than the readings."""
        return mean_of_cycles(self._given_nm)[-1] if self._torques is None else self._torques.reported_nm()

    def mass_matrix_kg_m2(self, q_rad: Floats) -> Floats:
        """(n, n) of the links and the tool at the readings `q_rad` (n,), without the rotors."""
        full = self._stated.inertia_at(self._position_at(q_rad))
        return full[np.ix_(self._driven, self._driven)]

    def load_nm(self, q_rad: Floats, qd_rad_s: Floats) -> Floats:
        """(n,) torques of gravity, Coriolis and centrifugal forces at readings and speeds (n,)."""
        qvel = np.zeros(self._engine.n_freedoms)
        qvel[self._driven] = qd_rad_s
        return self._stated.bias_at(self._position_at(q_rad), qvel)[self._driven]

    def _position_at(self, q_rad: Floats) -> Floats:
        qpos = self._engine.qpos.copy()
        qpos[self._at] = q_rad + self._offset_rad()
        return qpos

    def beam(self) -> Ray:
        """The laser in the base frame."""
        x, y, z = self._laser_origin.tolist()
        along = self._laser_axes.tolist()
        beam = Ray(x, y, z, along[2], along[5], along[8])
        return beam if self._hidden is None else self._hidden.bent(beam)

    def T_base_flange(self) -> Floats:
        """The true flange pose, (4, 4)."""
        pose = self._stiff_flange()
        return pose if self._hidden is None else self._hidden.carried(pose)

    def _stiff_flange(self) -> Floats:
        return _pose(*self._engine.site("flange"))

    def _offset_rad(self) -> Floats:
        own_rad = self._zero_rad + self._repeatability.offset_rad
        return own_rad if self._hidden is None else own_rad + self._hidden.turn_rad


def _pose(origin_m: Floats, axes: Floats) -> Floats:
    """(4, 4) of an origin (3,) and a rotation matrix (9,), row by row."""
    pose = np.eye(4)
    pose[:3, :3] = axes.reshape(3, 3)
    pose[:3, 3] = origin_m
    return pose
