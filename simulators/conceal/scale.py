"""The measure of effect over noise of one session: its own whitening, its own geometry."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import forward, jacobian
from simulators.conceal.artefacts import BAR_SIGMA_M
from simulators.conceal.belief import KnownDistance
from simulators.conceal.distances import in_sigmas
from simulators.conceal.geometry import Absorber
from simulators.conceal.observe import Observed, observe
from simulators.conceal.recorded import ENCODER_RAD
from simulators.conceal.rig import Artefacts, TrueRig
from simulators.conceal.rigs import DrawnRig
from simulators.conceal.schedule import Timetable
from simulators.conceal.seated import seated_tip_m
from simulators.conceal.strength import Scale
from simulators.defects.defect import Defect

Floats = NDArray[np.float64]


def scale_of(
    drawn: DrawnRig,
    table: Timetable,
    watch: Callable[[Sequence[Defect]], Observed],
    sigma_m: float,
    distances: Sequence[KnownDistance],
) -> Scale:
    """Whitened predictions of any geometry for the readings of a session without defects."""
    perfect = watch(())
    seated = isinstance(drawn.true.instrument, Artefacts)
    whiteners = _seat_whiteners(drawn.true, perfect.reading_rad, sigma_m) if seated else None

    def whiten(change_m: Floats) -> Floats:
        scaled = change_m / sigma_m if whiteners is None else np.einsum("rij,rj->ri", whiteners, change_m)
        return scaled.ravel()

    def predict(rig: TrueRig) -> Floats:
        values_m = observe(rig, table.scene, (), perfect.reading_rad, wire=perfect.values_m.shape[1] == 1).values_m
        return np.concatenate((whiten(values_m), in_sigmas(rig, distances)))

    def predict_seated(rig: TrueRig) -> Floats:
        assert isinstance(rig.instrument, Artefacts)  # noqa: S101 - narrows the type
        misses = whiten(seated_tip_m(rig, perfect.reading_rad) - rig.instrument.seat_m[table.scene.seat - 1])
        return np.concatenate((misses, rig.instrument.ends_m() / BAR_SIGMA_M))

    absorber = Absorber(drawn.true, drawn.spread, predict_seated if seated else predict)
    return Scale(watch, whiten, absorber, perfect)


def _seat_whiteners(true: TrueRig, reading_rad: Floats, sigma_m: float) -> Floats:
    """(row, 3, 3): inverse roots of the covariance of seat and encoders together, s^2 I + e^2 J J^T."""
    frames = forward(true.arm, reading_rad + true.arm.zero_rad)
    tip_m = frames.flange[:, :3, :3] @ true.tool_point_m + frames.flange[:, :3, 3]
    slope = jacobian(frames, tip_m)[:, :3]
    covariance = sigma_m**2 * np.eye(3) + ENCODER_RAD**2 * slope @ slope.swapaxes(-1, -2)
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)), dtype=np.float64)
