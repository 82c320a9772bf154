"""What physics adds to the difference of two encoders from stand to stand: a slip is judged only after it.

The torque of gravity at the pose (a soft drive), the side from which the joint came (play), and what the diagnosis of
the samples has found at the joint. Each is a column whose size the difference itself decides, so that nothing depends
on which of the two encoders sits where.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.search.null import is_slow
from calibrate.diagnose.state.fitted import Fitted
from calibrate.model.effects.gravity import likely_torque_nm
from calibrate.model.effects.ports import Perturbation
from calibrate.model.sensors.encoder_difference import NAME as ENCODER_DIFFERENCE
from calibrate.model.with_effects.new_poses import carried_over, extended
from calibrate.model.with_effects.ported_chain import perturbed_frames

Floats = NDArray[np.float64]
Causes = Callable[[int, Floats], Floats]  # joint (from 1) and poses (stand, joint) to columns (stand, m)


def causes_of(fitted: Fitted) -> Causes:
    """Of a fitted session, at any poses."""
    arm, drivers = fitted.session.arm, fitted.drivers
    values = fitted.geometry[: len(arm.parameters)]

    def columns(joint: int, q_rad: Floats) -> Floats:
        frames = perturbed_frames(arm, values, q_rad, Perturbation.none(len(q_rad), q_rad.shape[1]))
        away = np.abs(q_rad[:, None, :] - drivers.q_rad[None]).max(axis=2)
        there = extended(drivers, q_rad, frames, np.argmin(away, axis=1))
        out = [likely_torque_nm(there, joint)[-len(q_rad) :]]
        for accepted in fitted.accepted:
            term = accepted.term
            mine = term.port.between_encoders or term.port.instrument == ENCODER_DIFFERENCE
            if not mine or term.port.where != f"joint{joint}.angle" or is_slow(term):
                continue
            basis = carried_over(accepted, drivers, there)
            if basis is not None:
                out += list(np.sum(basis, axis=1).T)  # the port's other joints are zero
        return np.stack(out, axis=1)

    return columns
