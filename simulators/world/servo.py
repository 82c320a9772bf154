"""Joint servo: computed torque, so that the arm stands on its set-point whatever hangs at it.

    torque = M(q) (kp (q_ref - q) + kd (qd_ref - qd)) + h(q, qd)

with M the joint-space inertia and h gravity, Coriolis and centrifugal torque (Siciliano et al., "Robotics: Modelling,
Planning and Control", section 8.5.2, inverse dynamics control). kp = w^2, kd = 2 w gives every joint the same
critically damped error. The drive ends at its torque limit.

What it does not imitate: a real joint controller knows M and h only roughly and makes up for it with an integrator.
"""

import numpy as np
from numpy.typing import NDArray

from simulators.world.engine import Engine

Floats = NDArray[np.float64]
# The 0.13 mrad that a 3 rad/s^2 braking ramp leaves are below 0.1 urad after 70 ms, and steps of 1 ms stay stable.
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
        if (np.abs(torque_nm) > self._limit_nm).any():
            torque_nm = self._saturated(hold_nm, pull_nm)
        self.torque_nm = torque_nm
        self._engine.applied[self._driven] = self.torque_nm

    def _saturated(self, hold_nm: Floats, pull_nm: Floats) -> Floats:
        """Less acceleration for all joints alike, so that one drive at its limit does not throw the others about."""
        spare_nm = np.maximum(self._limit_nm - np.sign(pull_nm) * hold_nm, 0.0)
        share = np.min(spare_nm / np.maximum(np.abs(pull_nm), 1e-12), initial=1.0)
        return np.clip(hold_nm + share * pull_nm, -self._limit_nm, self._limit_nm)
