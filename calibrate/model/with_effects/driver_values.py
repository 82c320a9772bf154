"""Drivers of a session: what its rows were taken under, and what the model predicts at them."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from calibrate.model.chain import Standing, Used
from calibrate.model.effects.drivers import Drivers, Readout
from calibrate.model.sensors.catalogue import kind_of

Floats = NDArray[np.float64]
Number = TypeVar("Number", np.float64, np.int64)

HARDLY = 1e-2  # of the reach, rad, of the range of readings: an effect may be off by as much until drivers are renewed


def as_before(old: Drivers, new: Drivers) -> bool:
    """Whether what two states predict at the same samples is the same to an effect on top of them."""
    moved, reach_m = np.abs(new.frames - old.frames), np.abs(old.frames[..., :3, 3]).max(initial=0.0)
    if moved[..., :3].max(initial=0.0) > HARDLY or moved[..., :3, 3].max(initial=0.0) > HARDLY * reach_m:
        return False
    return all(_reads_as(old.readouts[name], now) for name, now in new.readouts.items())


def _reads_as(old: Readout, new: Readout) -> bool:
    for was, now, least in (
        (old.predicted, new.predicted, 0.0),
        (old.incidence_rad, new.incidence_rad, 1.0),
        (old.lean, new.lean, 1.0),
    ):
        if was is None or now is None or not new.seen.any():
            continue
        range_ = np.maximum(np.ptp(was[new.seen], axis=0), least)
        if np.any(np.abs(now - was)[new.seen] > HARDLY * range_):
            return False
    return True


def readout_at(
    name: str, sensor: Used | None, phi: Floats, expected: Floats, rows: NDArray[np.intp], frames: Floats
) -> Readout:
    """Of an instrument that sees these rows of the samples, with the values `phi` of its own parameters."""
    n = len(frames)
    predicted, seen = np.full((n, expected.shape[1]), np.nan), np.zeros(n, dtype=bool)
    predicted[rows], seen[rows] = expected, True
    stood = Standing() if sensor is None else sensor.standing(phi, frames[rows, -1])
    return Readout(
        kind_of(name),
        predicted,
        seen,
        _among(n, rows, stood.incidence_rad, np.nan),
        _among(n, rows, stood.lean, 0),
        _among(n, rows, stood.first_psd, 0),
        _among(n, rows, stood.place, 0),
        joints=() if sensor is None else sensor.joints_compared(),
    )


def _among(n: int, rows: NDArray[np.intp], values: NDArray[Number] | None, else_: float) -> NDArray[Number] | None:
    """(sample, ...) of values at some rows."""
    if values is None:
        return None
    out = np.full((n, *values.shape[1:]), else_, dtype=values.dtype)
    out[rows] = values
    return out
