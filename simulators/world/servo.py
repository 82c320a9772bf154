"""Joint servo: computed torque, so that the arm stands on its set-point whatever hangs at it.

    torque = M(q) (kp (q_ref - q) + kd (qd_ref - qd)) + h(q, qd)

with M the joint-space inertia and h gravity, Coriolis and centrifugal torque (Siciliano et al., "Robotics: Modelling,
Planning and Control", section 8.5.2, inverse dynamics control). kp = w^2, kd = 2 w gives every joint the same
critically damped error. The drive ends at its torque limit.

What it does not imitate: a real joint controller knows M and h only roughly and makes up for it with an integrator.

MuJoCo behind eight typed words: the one place that touches its untyped module.

A step of MuJoCo falls in two: `mj_step1` works out everything that belongs to the present state, `mj_step2` applies
forces and integrates. Here `step` is the second followed by the first, so that between steps all poses, inertias and
bias forces belong to the present state (MuJoCo documentation, "Programming", section "Simulation loop").
"""

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_mujoco: Any = mujoco  # MuJoCo ships no types


class Engine:
    """Model and state of a mechanism. The arrays are views of the state, not copies."""

    def __init__(self, mjcf: str) -> None:
        self._model: Any = _mujoco.MjModel.from_xml_string(mjcf)
        self._data: Any = _mujoco.MjData(self._model)
        self._scratch: Any = _mujoco.MjData(self._model)  # for questions about states that the mechanism is not in
        self.n_freedoms = int(self._model.nv)
        self.qpos: Floats = self._data.qpos
        self.qvel: Floats = self._data.qvel
        self.bias: Floats = self._data.qfrc_bias  # gravity, Coriolis and centrifugal forces
        self.qacc: Floats = self._data.qacc  # of the last step
        self.applied: Floats = self._data.qfrc_applied
        self._damping: Floats = self._model.dof_damping

    def refresh(self) -> None:
        """Computes everything again after `qpos` or `qvel` was written."""
        _mujoco.mj_step1(self._model, self._data)

    def step(self) -> None:
        """One time step under the applied forces."""
        _mujoco.mj_step2(self._model, self._data)
        _mujoco.mj_step1(self._model, self._data)

    def rub(self, dofs: NDArray[np.intp], friction_nm: Floats) -> None:
        """Takes friction (n,) from the applied forces of the coming step.

        Where it could turn a joint back within the step, it is integrated as that of a damper of friction / speed,
        which brings the joint to rest and not beyond, however steep its law. `mj_step1` has put in the force of the
        damper as it was before: that is given back.
        """
        speed = self.qvel[dofs]
        self.applied[dofs] += self._damping[dofs] * speed - friction_nm
        turned_back = np.abs(friction_nm) * self._model.opt.timestep > np.abs(speed) * self._model.dof_armature[dofs]
        steep = turned_back & (speed != 0.0)
        self._damping[dofs] = np.divide(friction_nm, speed, out=np.zeros_like(speed), where=steep)

    def joint_addresses(self, names: list[str]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Where hinge joints stand in `qpos` and in `qvel`."""
        joints = [self._model.joint(name) for name in names]
        return (
            np.array([int(joint.qposadr[0]) for joint in joints], dtype=np.intp),
            np.array([int(joint.dofadr[0]) for joint in joints], dtype=np.intp),
        )

    def site(self, name: str) -> tuple[Floats, Floats]:
        """Position (3,) m and rotation matrix (9,), row by row, of a named frame in the base frame."""
        site = self._data.site(name)
        return site.xpos, site.xmat

    def body(self, name: str) -> tuple[Floats, Floats]:
        """The same of a named body."""
        body = self._data.body(name)
        return body.xpos, body.xmat

    def inertia_times(self, vector: Floats) -> Floats:
        """M(q) vector, (n_freedoms,)."""
        product = np.empty(self.n_freedoms)
        _mujoco.mj_mulM(self._model, self._data, product, vector)
        return product

    def inertia_at(self, qpos: Floats) -> Floats:
        """M(q), (n_freedoms, n_freedoms), at any position, without the armature of the rotors."""
        full = np.empty((self.n_freedoms, self.n_freedoms))
        self._put_scratch(qpos, np.zeros(self.n_freedoms))
        _mujoco.mj_fullM(self._model, self._scratch, full)
        return full - np.diag(self._model.dof_armature)

    def bias_at(self, qpos: Floats, qvel: Floats) -> Floats:
        """Gravity, Coriolis and centrifugal forces, (n_freedoms,), in any state."""
        self._put_scratch(qpos, qvel)
        return self._scratch.qfrc_bias.copy()

    def _put_scratch(self, qpos: Floats, qvel: Floats) -> None:
        self._scratch.qpos[:], self._scratch.qvel[:] = qpos, qvel
        _mujoco.mj_step1(self._model, self._scratch)


# The 0.13 mrad that a 3 rad/s^2 braking ramp leaves are below 0.1 µrad after 70 ms, and steps of 1 ms stay stable.
BANDWIDTH_RAD_S = 150.0
STIFFNESS = BANDWIDTH_RAD_S**2
DAMPING = 2.0 * BANDWIDTH_RAD_S


class Servo:
    """Torques for the driven joints; passive joints of the same model (springs) get none."""

    def __init__(self, engine: Engine, driven: NDArray[np.intp], torque_limit_nm: Floats) -> None:
        self._engine = engine
        self._driven = driven
        self._limit_nm = torque_limit_nm
        self._pull_rad_s2: Floats = np.zeros(engine.n_freedoms)
        self.torque_nm: Floats = np.zeros(len(driven))

    def drive(self, error_rad: Floats, error_rad_s: Floats) -> None:
        """Applies the torques (n,) for the present state."""
        self._pull_rad_s2[self._driven] = STIFFNESS * error_rad + DAMPING * error_rad_s
        hold_nm = self._engine.bias[self._driven]
        pull_nm = self._engine.inertia_times(self._pull_rad_s2)[self._driven]
        torque_nm = hold_nm + pull_nm
        if np.count_nonzero(np.abs(torque_nm) > self._limit_nm):  # half the time of any()
            torque_nm = self._saturated(hold_nm, pull_nm)
        self.torque_nm = torque_nm
        self._engine.applied[self._driven] = self.torque_nm

    def _saturated(self, hold_nm: Floats, pull_nm: Floats) -> Floats:
        """Less acceleration for all joints alike, so that one drive at its limit does not throw the others about."""
        spare_nm = np.maximum(self._limit_nm - np.sign(pull_nm) * hold_nm, 0.0)
        share = np.min(spare_nm / np.maximum(np.abs(pull_nm), 1e-12), initial=1.0)
        return np.clip(hold_nm + share * pull_nm, -self._limit_nm, self._limit_nm)
