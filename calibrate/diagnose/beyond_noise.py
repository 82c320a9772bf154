"""Scatter far beyond what a tracker is believed to have: no noise of it, whatever statistics make of it.

A session whose rows all scatter alike looks like a noisy instrument. Beliefs of rig files are wrong by up to eight
times (mismatch study, lesson 14 of its second set), seldom by more, and a tracker's noise is certified.
"""

from collections.abc import Sequence

import numpy as np

from calibrate.diagnose.diagnosis import Unexplained
from calibrate.diagnose.fitted import Fitted
from calibrate.diagnose.tail import LEAST
from calibrate.effects.term import Missing
from calibrate.identification.session import believed_sigma
from calibrate.sensors.catalogue import kind_of
from calibrate.sensors.kind import Trait

BELIEVED = 10.0  # times the noise believed: beyond, it is something else
LENGTHS = 3  # components that are no turns
HIDDEN = ("cmd_minus_q", "approach", "qd", "payload")  # drivers that make poses scatter when they are not recorded


def beyond_noise(model: Fitted, missing: Sequence[Missing]) -> Unexplained | None:
    """What a tracker's positions scatter after all physics; None where it may be the noise that is believed."""
    session = model.session
    believed = session.rig.noise
    if believed.position_m is None or believed.joint_rad is not None:
        return None  # where joints are said to scatter, too, the fit has found how much of it is theirs
    whole, rows_of = model.noise.whole(model.problem.rows), model.problem.rows
    for measured, scatter, rows in zip(session.measured, whole, rows_of, strict=True):
        if Trait.CERTIFIED not in kind_of(measured.name).traits or len(rows) == 0:
            continue
        stated = float(np.sqrt(np.mean(believed_sigma(measured)[rows][:, :LENGTHS] ** 2)))
        found = np.diagonal(scatter.covariance, axis1=1, axis2=2)[:, :LENGTHS]
        times = float(np.sqrt(np.median(np.mean(found, axis=1)))) / max(stated, 1e-300)
        if times > BELIEVED:
            return _untold(times, [m for m in missing if m.driver in HIDDEN])
    return None


def _untold(times: float, lacking: Sequence[Missing]) -> Unexplained:
    columns = ", ".join(dict.fromkeys(m.column for m in lacking))
    why = f"positions scatter {times:.0f} times what the device is believed to, and no recorded column tells why"
    why += f"; not recorded: {columns}" if columns else ""
    return Unexplained("", tuple(dict.fromkeys(m.driver for m in lacking)), 1.0 - 1.0 / times**2, LEAST, why)
