"""The seam of arm models: joint angles to flange poses, with analytic derivatives."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from calibrate.model.parameters import Parameter

Floats = NDArray[np.float64]


class KinematicModel(Protocol):
    """A new model is one file and one line in arms/catalogue.py; tests/model/arms checks all of them by law."""

    @property
    def n_joints(self) -> int: ...

    @property
    def parameters(self) -> tuple[Parameter, ...]: ...

    def flange(self, theta: Floats, q_rad: Floats) -> Floats:
        """T_base_flange, (pose, 4, 4), for q_rad (pose, joint) and parameter values theta (param,)."""
        ...

    def twists(self, theta: Floats, q_rad: Floats) -> Floats:
        """Derivative of the flange by each parameter as a base-frame twist [v; w], (pose, 6, param)."""
        ...

    def joint_twists(self, theta: Floats, q_rad: Floats) -> Floats:
        """Derivative by each joint angle as a base-frame twist, (pose, 6, joint)."""
        ...
