"""MuJoCo behind eight typed words: the one place that touches its untyped module.

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
        self.applied: Floats = self._data.qfrc_applied

    def refresh(self) -> None:
        """Works everything out anew after `qpos` or `qvel` was written."""
        _mujoco.mj_step1(self._model, self._data)

    def step(self) -> None:
        """One time step under the applied forces."""
        _mujoco.mj_step2(self._model, self._data)
        _mujoco.mj_step1(self._model, self._data)

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
