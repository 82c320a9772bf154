"""Joint repeatability: after every motion the output of a gear stands a little off what the motor side says.

Mechanism: when a gear turns, teeth and rolling elements seat anew, so the output comes to rest N(0, sigma) away from
the motor-side angle, and stays there as long as nothing moves. A motion begins when the set-point changes after
standing; then the next offset is drawn and taken up along a smooth curve of SEATING_S, so that no step is seen. A
motion has ended when the set-point has not changed for SEATING_S: every curve is finished by then.

What it does not imitate: dependence on direction, load or distance (that is backlash, another mechanism).
"""

import math

import numpy as np
from numpy.typing import NDArray

from simulators.world.model import STEP_S

Floats = NDArray[np.float64]
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
