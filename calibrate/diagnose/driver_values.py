"""Drivers of a session: what its rows were taken under, and what the model predicts at them."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from calibrate.diagnose.session import Session
from calibrate.effects.drivers import Drivers, Readout, conditions_of, temperatures_of, uncoupled_samples
from calibrate.sensors.model import Standing, Used
from calibrate.weighting import Measured

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def drivers_of(session: Session, frames: Floats, expected: Mapping[str, Floats], own: Mapping[str, Floats]) -> Drivers:
    """At frames (sample, joint + 1, 4, 4) and expected readings (row, k) of each instrument, with the values of its own
    parameters.
    """
    readouts = {m.name: _readout(m, expected[m.name], own[m.name], frames) for m in session.measured}
    return drivers_at(session.rig, session.samples, frames, readouts, temperatures_of(session.samples))


def drivers_at(
    rig: Rig, samples: Samples, frames: Floats, readouts: Mapping[str, Readout], temperatures_degC: Mapping[str, Floats]
) -> Drivers:
    """Of any table of samples, with what the model predicts at them; temperatures (sample,) by place."""
    taken = conditions_of(uncoupled_samples(rig.arm, samples), temperatures_degC)
    return Drivers(**vars(taken), rig=rig, frames=frames, readouts=readouts)


def _readout(measured: Measured, expected: Floats, own: Floats, frames: Floats) -> Readout:
    chain = measured.problem.chain
    phi = own[len(chain.model.parameters) :]
    return readout_at(measured.name, chain.sensor, phi, expected, measured.sample_rows[:, -1], frames)


def readout_at(
    name: str, sensor: Used | None, phi: Floats, expected: Floats, rows: NDArray[np.intp], frames: Floats
) -> Readout:
    """Of an instrument that sees these rows of the samples, with the values `phi` of its own parameters."""
    n = len(frames)
    predicted, seen = np.full((n, expected.shape[1]), np.nan), np.zeros(n, dtype=bool)
    predicted[rows], seen[rows] = expected, True
    stood = Standing() if sensor is None else sensor.standing(phi, frames[rows, -1])
    return Readout(
        name,
        predicted,
        seen,
        None if stood.incidence_rad is None else _among(n, rows, stood.incidence_rad, np.nan),
        None if stood.lean is None else _among(n, rows, stood.lean, 0.0),
        None if stood.first_psd is None else _numbers(n, rows, stood.first_psd),
        None if stood.place is None else _numbers(n, rows, stood.place),
        joints=() if sensor is None else sensor.joints_compared(),
    )


def _among(n: int, rows: NDArray[np.intp], values: Floats, else_: float) -> Floats:
    """(sample, ...) of values at some rows."""
    out = np.full((n, *values.shape[1:]), else_)
    out[rows] = values
    return out


def _numbers(n: int, rows: NDArray[np.intp], values: Ints) -> Ints:
    """(sample,) zero elsewhere."""
    out = np.zeros(n, dtype=np.int64)
    out[rows] = values
    return out
